"""From finished runs to an answer: the ranked grasps, and one sentence on how it went."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fingersplit.contacts.grip_plan import plan_grip
from fingersplit.contacts.holding import GRAVITY, Holding
from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import assess
from fingersplit.contacts.wrench_space import WrenchSpace
from fingersplit.execution.execution import GraspExecution, plan_execution
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.guided_starts_kernel import TOUCHING
from fingersplit.parallel_grasps.sources.antipodal import MIN_OPENING
from fingersplit.planning.refining import candidate_of
from fingersplit.planning.run import Run
from fingersplit.result.grasp import HoldProbability
from fingersplit.robustness.execution import Execution
from fingersplit.robustness.features import Candidate
from fingersplit.robustness.judging import MAX_SIMULATED, estimate_holding, hold_probability, simulate_holding
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit.scene.task import Task

__all__ = ["RankedGrasp", "describe_outcome", "rank_runs"]

SAME_POSITION, SAME_ROTATION = 5e-3, 0.1
"""Palms nearer than this are one grasp, of which the better stays [m], [rad]."""
MAX_LACKS = 2
"""Violations that are told of the run that lacks least."""
TELLING = 12
"""Runs that tell of a hand's least width; fewer may all end elsewhere."""
BESIDE = 0.9
"""Distance of two pads on one side of a hand, in largest extents of an object, from which on they reach beside it."""


@dataclass(frozen=True, eq=False)
class RankedGrasp:
    """One ranked grasp with the run that found it.

    Attributes:
        rank: Place in the answer, 1 is best.
        run: The finger splitting.
        metrics: Every metric by name.
        holding: How it holds the object, with the forces that do.
        execution: Pre-grasp, approach and squeeze.
        p_hold: How probably it holds when it is executed; None for a grasp that cannot be.
        reason: Why it stands at this rank, in a sentence.
    """

    rank: int
    run: Run
    metrics: dict[str, float | None]
    holding: Holding
    execution: GraspExecution
    p_hold: HoldProbability | None
    reason: str

    @property
    def carries_weight(self) -> bool:
        """Whether contact forces inside the friction cones balance the weight for every tested gravity direction."""
        return self.holding.margin >= 0.0


def rank_runs(
    model: ObjectModel,
    runs: Sequence[Run],
    holdings: Sequence[Holding],
    top_k: int,
    friction: float,
    threads: int = 1,
    ranking: RankingOrder | None = None,
) -> tuple[RankedGrasp, ...]:
    """The best ``top_k`` runs that are not nearly a better one, with metrics, forces and execution.

    ``holdings`` say how the runs' grasps hold the object.

    Fewest violated constraints first, so feasible grasps lead; then those that carry the object's weight
    (``contacts.holding``). Among these by the probability that they hold when executed (``robustness``), or by the
    margin with which they hold, as ``ranking`` says; then by margin and Q. Of the best ``top_k``, those with a finger
    that only supports stand after the others.
    """
    if not runs:
        return ()
    ranking = ranking or RankingOrder()
    feasible = [i for i, run in enumerate(runs) if run.feasible]
    candidates = {i: candidate_of(runs[i], holdings[i]) for i in feasible}
    judged = estimate_holding(runs[0].hand, model, list(candidates.values()), friction, ranking.noise, threads)
    values = dict(zip(feasible, judged.tolist(), strict=True))

    def before(i: int) -> tuple[float, ...]:
        preferred = values.get(i, 0.0) if ranking.by == "p_hold" else 0.0
        return runs[i].violation_count, holdings[i].margin < 0.0, -preferred, -holdings[i].margin, -runs[i].last.quality

    most = max(top_k, MAX_SIMULATED) if ranking.simulation_budget else top_k
    kept = _different(sorted(range(len(runs)), key=before), runs, most)
    executions = {i: _execution(runs[i], holdings[i], model) for i in kept}
    simulated: dict[int, float] = {}
    if ranking.simulation_budget:
        wanted = [i for i in kept if i in candidates]
        simulated = _simulate(model, candidates, executions, wanted, runs[0].hand, friction, ranking, threads)
        values |= simulated
    kept.sort(key=before)
    kept.sort(key=lambda i: (runs[i].violation_count, holdings[i].margin < 0.0, executions[i].grip.supporting.any()))

    def p_hold(i: int) -> HoldProbability | None:
        return hold_probability(values[i], ranking.noise, simulated=i in simulated) if i in values else None

    return tuple(
        _planned(rank, runs[i], holdings[i], executions[i], p_hold(i), model, friction)
        for rank, i in enumerate(kept[:top_k], 1)
    )


def _different(order: Sequence[int], runs: Sequence[Run], most: int) -> list[int]:
    """The first ``most`` of ``order`` that are not nearly one before them."""
    positions = np.array([run.last["palm_position"] for run in runs])
    rotations = np.array([run.last["palm_rotation"].ravel() for run in runs])
    kept: list[int] = []
    for i in order:
        if len(kept) == most:
            break
        near = np.linalg.norm(positions[kept] - positions[i], axis=1) < SAME_POSITION
        cosines = (rotations[kept][near] @ rotations[i] - 1) / 2
        if not (np.arccos(np.clip(cosines, -1.0, 1.0)) < SAME_ROTATION).any():
            kept.append(i)
    return kept


def _simulate(
    model: ObjectModel,
    candidates: Mapping[int, Candidate],
    executions: Mapping[int, GraspExecution],
    wanted: Sequence[int],
    hand: Hand,
    friction: float,
    ranking: RankingOrder,
    threads: int,
) -> dict[int, float]:
    """Simulated probabilities of holding of those of ``wanted`` that there is time for."""
    if not wanted:
        return {}
    pieces = decompose(model.mesh) if ranking.pieces is None else ranking.pieces()
    executed = []
    for i in wanted:
        grasp, grip = candidates[i].grasp, executions[i].grip
        opened = executions[i].pregrasp_joints
        parts = opened, grasp.joints, grip.targets, grip.stiffness, grip.damping
        executed.append((candidates[i], Execution(grasp.object_from_palm, *parts)))
    found = simulate_holding(hand, model, pieces, executed, friction, ranking.noise, ranking.simulation_budget, threads)
    return {wanted[place]: value for place, value in found.items()}


def _execution(run: Run, holding: Holding, model: ObjectModel) -> GraspExecution:
    """How a run's grasp is executed, with a grip that relies on the friction that counts at each contact."""
    grip = plan_grip(
        run.final, run.hand, friction=holding.frictions, mass=model.mass, center_of_mass=model.center_of_mass
    )
    return plan_execution(run.problem, run.hand, run.last, grip, run.outcome.way)


def _planned(
    rank: int,
    run: Run,
    holding: Holding,
    execution: GraspExecution,
    p_hold: HoldProbability | None,
    model: ObjectModel,
    friction: float,
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
        p_hold=p_hold,
        reason=_reason(run, holding, execution, p_hold, model),
    )


def _reason(
    run: Run, holding: Holding, execution: GraspExecution, p_hold: HoldProbability | None, model: ObjectModel
) -> str:
    """Why a grasp stands where it does, in a sentence or two."""
    if not run.feasible:
        return f"Ranked after every feasible grasp: {run.violations[0]}"
    names = [finger.name for finger in run.hand.fingers]
    weakest = names[int(holding.frictions.argmin())]
    held = _held(run, holding, model.mass * GRAVITY)
    only = ", ".join(name for name, rests in zip(names, execution.grip.supporting, strict=True) if rests)
    supports = f" Takes no share of the grip and only supports: {only}." if only else ""
    unseen = ", ".join(name for name, is_so in zip(names, model.is_assumed(run.final.contacts), strict=True) if is_so)
    assumed = f" On a side that was not seen but assumed, which may be elsewhere: {unseen}." if unseen else ""
    approach = "" if execution.pregrasp_pose is not None else " No collision-free straight approach."
    lowest = f"lowest effective friction coefficient: {holding.frictions.min():.2f} at {weakest}"
    likely = (
        "" if p_hold is None else f" Probability of holding when executed: {p_hold.value:.2f}, {p_hold.robustness}."
    )
    return f"{held}; {lowest}.{supports}{assumed}{likely}{approach}"


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
    advice = _too_small(runs, hand, model) or f"{_nearest_miss(runs)}{ends.most_common(1)[0][0].advice}"
    return f"None of {len(runs)} starts ended in a feasible grasp: {reasons}. {advice}"


def _nearest_miss(runs: Sequence[Run]) -> str:
    """What the run with the fewest violations lacks, of these the one whose pads are nearest to the surface."""
    best = min(runs, key=lambda run: (run.violation_count, float(run.last.residuals[: len(run.hand.fingers)].max())))
    if not best.violations:
        return ""
    return f"What the nearest of them lacks: {' '.join(best.violations[:MAX_LACKS])} "


def _too_small(runs: Sequence[Run], hand: Hand, model: ObjectModel) -> str:
    """A sentence for an object that pads on one side of the hand are too far apart for; empty for others."""
    sides = hand.gripper.groups
    pairs = [(i, j) for i in range(len(sides)) for j in range(i) if sides[i] == sides[j]]
    if not pairs:
        return ""
    nearest = min(float(np.linalg.norm(run.last.pads[i] - run.last.pads[j])) for run in runs for i, j in pairs)
    size = float(model.mesh.extents.max())
    if nearest < BESIDE * size or len(runs) < TELLING:
        return ""
    return (
        f"The object is {1e3 * size:.2g} mm in its largest extent, and pads on one side of this hand stayed "
        f"{1e3 * nearest:.2g} mm apart in every start: it is too small for this hand."
    )
