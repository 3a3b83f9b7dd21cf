"""Many starts: parallel grasps mapped to the hand, the most promising split, every run with its trace."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.splitting.acceptance import (
    REACHED_COLLISION,
    REACHED_ITERATION_LIMIT,
    REACHED_PAD_ANGLE,
    STOPPED_RISING,
)
from fingersplit.splitting.finger_splitting import SETTLE_ITERATIONS, split_fingers
from fingersplit.splitting.mapping import map_grasp
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.state import PENETRATION, GraspState, Problem, copy_state, new_state, new_work
from fingersplit.splitting.termination import Termination
from fingersplit.splitting.trace import Trace, new_trace
from fingersplit.transforms import pose_matrix

__all__ = ["Run", "Start", "build_problem", "map_starts", "split_start"]

STANDOFFS = 9


@dataclass(frozen=True, eq=False)
class Start:
    """A parallel grasp taken over by the hand.

    Attributes:
        parallel_grasp: The two contacts and the approach.
        cost: How far the mapped state is from a good start, see ``map_grasp``.
        state: The mapped state.
    """

    parallel_grasp: ParallelGrasp
    cost: float
    state: GraspState


@dataclass(frozen=True, eq=False)
class Run:
    """One finished finger splitting.

    Attributes:
        start: Where it began.
        initial: The mapped grasp.
        final: The grasp it ended with, contacts and residuals measured against the triangles.
        termination: Why it ended.
        violations: A sentence for every constraint the final grasp violates.
        scores: Q, w1 Q_o, w2 Q_h and deepest penetration [m] of the final grasp, (4,).
        trace: Every accepted state.
        rounds: Outer iterations of Algorithm 3.
        cpo: Tangent searches of all CPO, the rejected ones included.
        ppo: Tangent searches of all PPO, likewise.
        seconds: CPO tangent search, projection and test, collision; the same for PPO; total, (7,) [s].
    """

    start: Start
    initial: Grasp
    final: Grasp
    termination: Termination
    violations: tuple[str, ...]
    scores: NDArray[np.float64]
    trace: Trace
    rounds: int
    cpo: int
    ppo: int
    seconds: tuple[float, ...]

    @property
    def feasible(self) -> bool:
        """Whether the grasp keeps every constraint."""
        return not self.violations


def build_problem(model: ObjectModel, hand: Hand, settings: PlannerSettings) -> Problem:
    """Everything the kernels read, in one tuple."""
    x, y, z = model.center_of_mass.tolist()
    return Problem(hand.arrays, model.surface, model.collision, (x, y, z), settings.for_kernels())


def map_starts(problem: Problem, hand: Hand, grasps: Iterable[ParallelGrasp], count: int) -> list[Start]:
    """Map every parallel grasp with both finger assignments and keep the ``count`` most promising starts.

    A pair of contacts that already has a start in the list must do better to get another one, so the starts spread
    over the object. Starts whose mapping failed are left out.
    """
    candidate, aim, work = new_state(hand.arrays), new_state(hand.arrays), new_work(hand.arrays)
    standoffs = np.linspace(*hand.gripper.standoff, STANDOFFS)
    mapped: list[Start] = []
    for grasp in grasps:
        for first, second in (grasp.contacts, grasp.contacts[::-1]):
            state = new_state(hand.arrays)
            jaws_and_approach = tuple(first), tuple(second), tuple(grasp.approach)
            cost = map_grasp(problem, hand.gripper, *jaws_and_approach, standoffs, state, candidate, aim, work)
            if math.isfinite(cost):
                mapped.append(Start(grasp, cost, state))
    uses: Counter[bytes] = Counter()
    spread: list[tuple[float, Start]] = []
    for start in sorted(mapped, key=lambda start: start.cost):
        pair = start.parallel_grasp.contacts.tobytes()
        uses[pair] += 1
        spread.append((start.cost * uses[pair], start))
    return [start for _, start in sorted(spread, key=lambda entry: entry[0])[:count]]


def split_start(problem: Problem, hand: Hand, start: Start) -> Run:
    """Run Algorithm 3 from a mapped start."""
    settings = problem.settings
    state, candidate, trial = new_state(hand.arrays), new_state(hand.arrays), new_state(hand.arrays)
    copy_state(state, start.state)
    work = new_work(hand.arrays)
    capacity = 2 * settings.max_outer_iterations * settings.max_inner_iterations + SETTLE_ITERATIONS + 1
    arrays = new_trace(capacity, len(hand.fingers), len(hand.joint_names))
    began = perf_counter()
    end, rounds, cpo, ppo = split_fingers(problem, state, candidate, trial, work, arrays)
    seconds = (*work.times.tolist(), perf_counter() - began)
    violated, violations = _violations(problem, hand, state)
    return Run(
        start=start,
        initial=_grasp(hand, start.state),
        final=_grasp(hand, state),
        termination=violated if violated is not None else _ENDS[end],
        violations=violations,
        scores=state.scores.copy(),
        trace=Trace.from_arrays(arrays),
        rounds=rounds,
        cpo=cpo,
        ppo=ppo,
        seconds=seconds,
    )


_ENDS = {
    STOPPED_RISING: Termination.CONVERGED,
    REACHED_COLLISION: Termination.STOPPED_BY_COLLISION,
    REACHED_PAD_ANGLE: Termination.STOPPED_BY_PAD_ANGLE,
    REACHED_ITERATION_LIMIT: Termination.ITERATION_LIMIT,
}


def _violations(problem: Problem, hand: Hand, state: GraspState) -> tuple[Termination | None, tuple[str, ...]]:
    """Every violated constraint as a sentence, and what the first one is called."""
    settings = problem.settings
    found: list[tuple[Termination, str]] = []
    for f, finger in enumerate(hand.fingers):
        if state.residuals[f] > settings.contact_tolerance:
            found.append(
                (
                    Termination.CONTACT_OFF_SURFACE,
                    f"The pad of {finger.name} is {1e3 * state.residuals[f]:.1f} mm from touching the surface; "
                    f"allowed: {1e3 * settings.contact_tolerance:g} mm.",
                )
            )
    for f, finger in enumerate(hand.fingers):
        if state.pad_angles[f] > settings.pad_angle_limit:
            found.append(
                (
                    Termination.PAD_ANGLE_VIOLATED,
                    f"The pad of {finger.name} is tilted {state.pad_angles[f]:.2f} rad against the surface; "
                    f"allowed: {settings.pad_angle_limit:g} rad.",
                )
            )
    if state.scores[PENETRATION] > settings.penetration_tolerance:
        found.append(
            (
                Termination.IN_COLLISION,
                f"A link lies {1e3 * state.scores[PENETRATION]:.1f} mm inside the object; "
                f"allowed: {1e3 * settings.penetration_tolerance:g} mm.",
            )
        )
    for name, q, low, high in zip(hand.joint_names, state.pose.joints, hand.lower, hand.upper, strict=True):
        if not low <= q <= high:
            found.append(
                (Termination.JOINT_LIMIT_VIOLATED, f"{name} is at {q:.3f} rad; allowed: {low:.3f} to {high:.3f} rad.")
            )
    return (found[0][0] if found else None), tuple(sentence for _, sentence in found)


def _grasp(hand: Hand, state: GraspState) -> Grasp:
    towards = state.contacts - state.pose.pads
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    arrays = (
        pose_matrix(state.pose.palm_rotation, state.pose.palm_position),
        state.pose.joints.copy(),
        state.contacts.copy(),
        state.normals.copy(),
        state.pose.pads + hand.arrays.pad_radii[:, None] * towards,
        state.residuals.copy(),
        state.pad_angles.copy(),
    )
    for array in arrays:
        array.setflags(write=False)
    return Grasp(*arrays)
