"""One finished finger splitting: where it began, what it found, why it ended."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingersplit.feasibility.violations import Limits, Violation, describe_violations
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.scene.preparing import PreparedScene
from fingersplit.splitting.acceptance_kernel import (
    REACHED_COLLISION,
    REACHED_ITERATION_LIMIT,
    REACHED_OBSTACLE,
    REACHED_PAD_ANGLE,
    REACHED_REGION,
    STOPPED_RISING,
)
from fingersplit.splitting.finger_splitting_kernel import SETTLE_ITERATIONS, split_fingers
from fingersplit.splitting.state import Problem, new_states, new_times, new_work
from fingersplit.splitting.termination import Termination
from fingersplit.splitting.trace import Trace, new_trace
from fingersplit.transforms import pose_matrix

__all__ = ["Run"]

_ENDS = {
    STOPPED_RISING: Termination.CONVERGED,
    REACHED_COLLISION: Termination.STOPPED_BY_COLLISION,
    REACHED_PAD_ANGLE: Termination.STOPPED_BY_PAD_ANGLE,
    REACHED_ITERATION_LIMIT: Termination.ITERATION_LIMIT,
    REACHED_OBSTACLE: Termination.STOPPED_BY_OBSTACLE,
    REACHED_REGION: Termination.STOPPED_BY_REGION,
}


@dataclass(frozen=True, eq=False)
class Run:
    """One finished finger splitting.

    Attributes:
        problem: What the kernels were given.
        hand: The hand.
        parallel_grasp: Where it came from.
        first: The mapped start, a ``STATE`` record.
        last: The state it ended with, contacts and residuals measured against the triangles.
        outcome: ``OUTCOME`` record.
        scene: What the request said of the world around; None for nothing.
        refined_from: The run as the splitting left it, when its grasp was refined afterwards; None otherwise.
    """

    problem: Problem
    hand: Hand
    parallel_grasp: ParallelGrasp
    first: np.record
    last: np.record
    outcome: np.record
    scene: PreparedScene | None = None
    refined_from: "Run | None" = None

    @cached_property
    def feasible(self) -> bool:
        """Whether the grasp keeps every constraint."""
        return bool(self.outcome["violations"] == 0)

    @property
    def violations(self) -> tuple[str, ...]:
        """A sentence for every constraint the final grasp violates."""
        return tuple(violation.sentence for violation in self._violations)

    @property
    def violation_count(self) -> int:
        """How many constraints the final grasp violates."""
        return int(self.outcome["violations"]).bit_count()

    @property
    def self_clearance(self) -> float | None:
        """Least distance of two links that may not meet [m], negative inside; None when they are far apart."""
        clearance = float(self.last.self_clearance)
        return clearance if math.isfinite(clearance) else None

    @property
    def termination(self) -> Termination:
        """Why it ended: the first violated constraint, or what stopped the search."""
        return _ENDS[self.outcome.end] if self.feasible else self._violations[0].termination

    @cached_property
    def initial(self) -> Grasp:
        """The mapped grasp."""
        return _grasp(self.hand, self.first)

    @cached_property
    def final(self) -> Grasp:
        """The grasp it ended with."""
        return _grasp(self.hand, self.last)

    @property
    def scores(self) -> NDArray[np.float64]:
        """Q, w1 Q_o, w2 Q_h and deepest penetration [m] of the final grasp, (4,)."""
        return np.array([self.last[name] for name in ("quality", "object_quality", "hand_quality", "penetration")])

    @property
    def seconds(self) -> tuple[float, ...]:
        """CPO tangent search, projection and test, collision; the same for PPO; total, (7,) [s]."""
        times = self.outcome["times"]
        return (*times["cpo"].item(), *times["ppo"].item(), float(self.outcome["total"]))

    @cached_property
    def trace(self) -> Trace:
        """Every accepted state; the run is repeated for it, which gives the same states."""
        settings, states = self.problem.settings, new_states(3)
        steps = 2 * settings.max_outer_iterations * settings.max_inner_iterations
        rows = new_trace(int(steps) + SETTLE_ITERATIONS + 1)
        states[0] = self.first
        split_fingers(self.problem, states, new_work(), new_times(), rows)
        return Trace.from_rows(rows, len(self.hand.fingers), len(self.hand.joint_names))

    @property
    def _violations(self) -> tuple[Violation, ...]:
        names = () if self.scene is None else self.scene.names
        limits = Limits(self.problem.limits, self.outcome.way, names)
        return describe_violations(int(self.outcome.violations), self.hand, self.problem.settings, self.last, limits)


def _grasp(hand: Hand, state: np.record) -> Grasp:
    fingers = len(hand.fingers)
    # Fields by key: as attributes of a record they cost ten times as much.
    pads, contacts = state["pads"][:fingers], state["contacts"][:fingers]
    towards = contacts - pads
    towards /= np.sqrt((towards * towards).sum(axis=1, keepdims=True))
    arrays = (
        pose_matrix(state["palm_rotation"], state["palm_position"]),
        state["joints"][: len(hand.joint_names)].copy(),
        contacts.copy(),
        state["normals"][:fingers].copy(),
        pads + hand.arrays["pad_radii"][:fingers, None] * towards,
        state["residuals"][:fingers].copy(),
        state["pad_angles"][:fingers].copy(),
    )
    for array in arrays:
        array.setflags(write=False)
    return Grasp(*arrays)
