"""From finished runs to an answer: the ranked grasps, and one sentence on how it went."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip_plan import plan_grip
from fingersplit.contacts.holding import GRAVITY, Contacts, Holding, assess_holding
from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import assess
from fingersplit.contacts.wrench_space import WrenchSpace
from fingersplit.execution.execution import GraspExecution, plan_execution
from fingersplit.hands.drivers import driver_jacobians
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.antipodal import MIN_OPENING
from fingersplit.parallel_grasps.guided_starts_kernel import TOUCHING
from fingersplit.planning.run import Run
from fingersplit.scene.task import Task

__all__ = ["RankedGrasp", "describe_outcome", "rank_runs"]

SAME_POSITION, SAME_ROTATION = 5e-3, 0.1
"""Palms nearer than this are one grasp, of which the better stays [m], [rad]."""


@dataclass(frozen=True, eq=False)
class RankedGrasp:
    """One ranked grasp with the run that found it.

    Attributes:
        rank: Place in the answer, 1 is best.
        run: The finger splitting.
        metrics: Every metric by name.
        holding: How it holds the object, with the forces that do.
        execution: Pre-grasp, approach and squeeze.
        reason: Why it stands at this rank, in a sentence.
    """

    rank: int
    run: Run
    metrics: dict[str, float | None]
    holding: Holding
    execution: GraspExecution
    reason: str

    @property
    def carries_weight(self) -> bool:
        """Whether contact forces inside the friction cones balance the weight for every tested gravity direction."""
        return self.holding.margin >= 0.0


def rank_runs(
    model: ObjectModel, runs: Sequence[Run], top_k: int, friction: float, threads: int = 1
) -> tuple[RankedGrasp, ...]:
    """The best ``top_k`` runs that are not nearly a better one, with metrics, forces and execution.

    Fewest violated constraints first, so feasible grasps lead; then by the margin with which they hold the object's
    weight (``contacts.holding``), so that no feasible grasp that cannot carry it stands before one that can; where none
    can carry it, by Q. Of the best ``top_k``, those with a finger that only supports stand after the others.
    """
    if not runs:
        return ()
    loads = _loads(runs[0], model)
    center = model.center_of_mass
    holdings = assess_holding(_contacts(runs), model.surface, friction, model.mass, center, threads, loads)
    order = sorted(
        range(len(runs)),
        key=lambda i: (runs[i].violation_count, -holdings[i].margin, -runs[i].last.quality),
    )
    kept: list[int] = []
    for i in order:
        if len(kept) == top_k:
            break
        if not any(_nearly_same(runs[i], runs[better]) for better in kept):
            kept.append(i)
    executions = {i: _execution(runs[i], holdings[i], model) for i in kept}
    kept.sort(key=lambda i: (runs[i].violation_count, holdings[i].margin < 0.0, executions[i].grip.supporting.any()))
    return tuple(_planned(rank, runs[i], holdings[i], executions[i], model, friction) for rank, i in enumerate(kept, 1))


def _loads(run: Run, model: ObjectModel) -> NDArray[np.float64] | None:
    """Loads of a request's task (L, 6), see ``assess_holding``; None for the weight alone, whichever way is down."""
    if run.scene is None or run.scene.constraints.task == Task():
        return None
    constraints = run.scene.constraints
    gravity = np.array(constraints.scene.gravity)
    return constraints.task.loads(model.mass, model.center_of_mass, gravity, run.scene.world_from_object)


def _execution(run: Run, holding: Holding, model: ObjectModel) -> GraspExecution:
    """How a run's grasp is executed, with a grip that relies on the friction that counts at each contact."""
    grip = plan_grip(
        run.final, run.hand, friction=holding.frictions, mass=model.mass, center_of_mass=model.center_of_mass
    )
    return plan_execution(run.problem, run.hand, run.last, grip, run.outcome.way)


def _planned(
    rank: int, run: Run, holding: Holding, execution: GraspExecution, model: ObjectModel, friction: float
) -> RankedGrasp:
    final = run.final
    space = WrenchSpace(final.contacts, final.normals, friction, model.center_of_mass, model.radius)
    metrics = assess(GraspState(space, run.scores, holding))
    return RankedGrasp(
        rank=rank,
        run=run,
        metrics=metrics,
        holding=holding,
        execution=execution,
        reason=_reason(run, holding, execution, model.mass * GRAVITY),
    )


def _reason(run: Run, holding: Holding, execution: GraspExecution, weight: float) -> str:
    """Why a grasp stands where it does, in a sentence or two."""
    if not run.feasible:
        return f"Ranked after every feasible grasp: {run.violations[0]}"
    weakest = run.hand.fingers[int(holding.frictions.argmin())].name
    held = _held(run, holding, weight)
    only = [finger.name for finger, rests in zip(run.hand.fingers, execution.grip.supporting, strict=True) if rests]
    supports = f" Takes no share of the grip and only supports: {', '.join(only)}." if only else ""
    approach = "" if execution.pregrasp_pose is not None else " No collision-free straight approach."
    lowest = f"lowest effective friction coefficient: {holding.frictions.min():.2f} at {weakest}"
    return f"{held}; {lowest}.{supports}{approach}"


def _held(run: Run, holding: Holding, weight: float) -> str:
    """What a grasp carries, and with how much to spare."""
    task = Task() if run.scene is None else run.scene.constraints.task
    carried, every = f"the object's weight ({weight:.2f} N)", "for every tested gravity direction"
    worst = f"with gravity along {_direction_name(holding.gravity)}"
    if task.gravity == "scene":
        every, worst = "under the scene's gravity", "there"
    if task.wrenches:
        carried = f"{carried} and every wrench of the task"
        number = holding.load % (1 + len(task.wrenches))
        worst = f"{worst} and wrench {number - 1}" if number else f"{worst} and no wrench"
    if holding.margin == -math.inf:
        return f"Cannot balance {carried}: the contacts lie nearly on a line"
    if holding.margin < 0:
        return f"Cannot support {carried} {worst}: the contacts lack {-holding.margin:.2f} N of friction force"
    return f"Supports {carried} {every}; minimum friction margin {holding.margin:.2f} N, {worst}"


def _direction_name(direction: np.ndarray) -> str:
    axis = int(np.abs(direction).argmax())
    return f"{'-' if direction[axis] < 0 else '+'}{'xyz'[axis]}"


def _contacts(runs: Sequence[Run]) -> Contacts:
    """Contacts of all final grasps as arrays."""
    hand = runs[0].hand
    points, normals, jacobians = (
        np.array([run.last[name][: len(hand.fingers)] for run in runs]) for name in ("contacts", "normals", "jacobians")
    )
    return Contacts(points, normals, driver_jacobians(hand.arrays, jacobians), hand.torque_limits)


def _nearly_same(a: Run, b: Run) -> bool:
    """Whether two grasps put the hand in nearly the same place."""
    first, second = a.last, b.last
    if np.linalg.norm(first.palm_position - second.palm_position) >= SAME_POSITION:
        return False
    cosine = (np.sum(first.palm_rotation * second.palm_rotation) - 1) / 2
    return bool(math.acos(min(1.0, max(-1.0, cosine))) < SAME_ROTATION)


def _thickness(model: ObjectModel) -> str:
    """What a sentence adds for an object thinner than some pairs must be apart."""
    thickness = 2e3 * model.mesh.volume / model.mesh.area  # of a plate
    if thickness >= 2e3 * TOUCHING:
        return ""
    return (
        f" The object is about {thickness:.2g} mm thick, and pairs nearer than {1e3 * MIN_OPENING:g} mm "
        f"({2e3 * TOUCHING:g} mm for surface fitting) are left out."
    )


def describe_outcome(
    grasps: int, runs: Sequence[Run], hand: Hand, friction: float, model: ObjectModel, carries: bool
) -> str:
    """How the runs that came of ``grasps`` parallel grasps ended, in words; why none is feasible, if none is."""
    feasible = sum(run.feasible for run in runs)
    if feasible:
        weak = "" if carries else " None of the ranked grasps can support the object's weight in every direction."
        return f"{feasible} of {len(runs)} starts ended in a feasible grasp.{weak}"
    if grasps == 0:
        low, high = (1e3 * x for x in hand.gripper.opening)
        return (
            f"No parallel grasp exists to start from: no two opposite surface points lie inside each other's friction "
            f"cones (friction {friction:g}) within the hand's opening of {low:g} to {high:g} mm.{_thickness(model)}"
        )
    if not runs:
        return (
            f"None of the {grasps} parallel grasps could be taken over by the hand: no standoff brings all fingertips "
            f"within reach of the surface next to the two contacts."
        )
    ends = Counter(run.termination for run in runs)
    reasons = ", ".join(f"{count} {end.label.replace('_', ' ')}" for end, count in ends.most_common())
    return f"None of {len(runs)} starts ended in a feasible grasp: {reasons}. {ends.most_common(1)[0][0].advice}"
