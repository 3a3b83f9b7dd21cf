"""A grasp of a stored result with its history: the search, and where it was verified the simulation, are run again.

Both give the same on the same machine, and a search takes less than a millisecond, so results carry no histories.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ResultError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.run import Run
from fingersplit.planning.starts import build_problem, choose_starts, split_starts
from fingersplit.result.grasp import GraspResult
from fingersplit.result.plan import PlanResult
from fingersplit.result.verification import Verification
from fingersplit.scene.attaching import attach_bodies
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene, prepare_scene
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.trace import PHASE_NAMES, QUALITY, Trace
from fingersplit.verification import SimulationFrames, repeat_simulation
from fingersplit.verification.protocols import load_protocol
from fingersplit.verification.protocols.pick import Pick
from fingersplit.verification.ranked_pick import ResultPicks

__all__ = ["QualityCurve", "ReplayedGrasp", "replay"]

SAME = 1e-6
"""Joint angles of the same grasp differ by less [rad]."""


@dataclass(frozen=True, eq=False)
class QualityCurve:
    """Q of every state (T,), the phase that led to it, and the largest distance of a pad from its contact (T,) [m]."""

    quality: NDArray[np.float64]
    phases: tuple[str, ...]
    residual: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReplayedGrasp:
    """A grasp of a result with its history.

    Attributes:
        grasp: The grasp as it stands in the result.
        friction: Coulomb friction that it was planned for.
        trace: Every accepted state of the search.
        scene: What stood around the object.
        frames: The frames of the simulation that verified it, None when there was none.
        initial_frames: The same for its mapped start.
        rejected_by: Candidates that each obstacle rejected.
    """

    grasp: GraspResult
    friction: float
    trace: Trace
    scene: PreparedScene
    frames: SimulationFrames | None = None
    initial_frames: SimulationFrames | None = None
    rejected_by: Mapping[str, int] = field(default_factory=dict)

    @property
    def curve(self) -> QualityCurve:
        """How quality and residuals went."""
        trace = self.trace
        phases = tuple(PHASE_NAMES[phase] for phase in trace.phases.tolist())
        return QualityCurve(trace.scores[:, QUALITY], phases, trace.residuals.max(axis=1))


def replay(
    result: PlanResult,
    rank: int,
    model: ObjectModel,
    hand: Hand,
    pieces: Callable[[], ConvexPieces] | None = None,
    obstacle: Callable[[str], ObjectModel] | None = None,
) -> ReplayedGrasp:
    """Run the search of one grasp again, and on request the simulations that verified it.

    Args:
        result: The result, just planned or read from a file.
        rank: Rank of the grasp, from 1.
        model: The object that it was planned for.
        hand: The hand that it was planned for.
        pieces: Gives the object as the simulation collides it, called when the grasp was verified; None to leave the
            simulations out.
        obstacle: Gives the model of an obstacle that is named by its id; None where there are none.

    Raises:
        ResultError: No such rank, another object or hand, or the grasp could not be reproduced.
        SettingsError: The result names settings, protocols or controllers that this version does not know.
    """
    result.check_origin(model, hand)
    hand, grasp = result.active_grip(hand), result.grasp(rank)
    run, scene = _repeat_search(result, grasp, model, hand, obstacle)
    again = _Simulations(result, model, hand, pieces, obstacle)
    return ReplayedGrasp(
        grasp=grasp,
        friction=result.friction,
        trace=run.trace,
        scene=scene,
        frames=again.verified(grasp, run.final if grasp.split_grasp is None else grasp.for_hand(hand)),
        initial_frames=again.frames(grasp.initial.verification, run.initial),
        rejected_by={} if result.scene is None else result.scene.rejected_by,
    )


def _repeat_search(
    result: PlanResult,
    grasp: GraspResult,
    model: ObjectModel,
    hand: Hand,
    obstacle: Callable[[str], ObjectModel] | None,
) -> tuple[Run, PreparedScene]:
    """The run from the grasp's parallel grasp that ends in the grasp, with either finger assignment, and its scene."""
    settings = PlannerSettings.from_document(result.provenance.planner)
    constraints = Constraints.from_document(result.provenance.constraints)
    if obstacle is not None:
        constraints = constraints.resolved(obstacle)
    hand = attach_bodies(hand, constraints.end_effector.attached_bodies)
    scene = prepare_scene(constraints, model, hand)
    problem = build_problem(model, hand, settings, scene)
    given = grasp.initial.parallel_grasp
    parallel_grasp = ParallelGrasp(np.array(given.contacts), np.array(given.approach))
    starts = choose_starts(problem, hand, [parallel_grasp], 2, threads=1, report=_silent)
    ended = grasp.joints if grasp.split_grasp is None else grasp.split_grasp.joints
    first, last = grasp.initial.for_hand(hand).joints, np.array([ended[name] for name in hand.joint_names])
    for run in split_starts(problem, model.patches, hand, starts, threads=1, report=_silent):
        if np.abs(run.final.joints - last).max() < SAME and np.abs(run.initial.joints - first).max() < SAME:
            return run, scene
    raise ResultError(
        f"The grasp of rank {grasp.rank} could not be reproduced: the same search ends in another grasp here. It was "
        f"planned by Fingersplit {result.provenance.software_version}, maybe on another kind of machine; plan again."
    )


@dataclass(frozen=True, eq=False)
class _Simulations:
    """Simulates again what has a report."""

    result: PlanResult
    model: ObjectModel
    hand: Hand
    pieces: Callable[[], ConvexPieces] | None
    obstacle: Callable[[str], ObjectModel] | None

    def verified(self, planned: GraspResult, grasp: Grasp) -> SimulationFrames | None:
        """Of a grasp of the result."""
        report = planned.verification
        if report is not None and self.pieces is not None and isinstance(load_protocol(report.protocol), Pick):
            picks = ResultPicks(self.result, self.model, self.hand, self.pieces(), self.obstacle)
            return picks.frames(planned, report)
        return self.frames(report, grasp)

    def frames(self, report: Verification | None, grasp: Grasp) -> SimulationFrames | None:
        if report is None or self.pieces is None:
            return None
        return repeat_simulation(report, grasp, self.hand, self.model, self.pieces()).frames


def _silent(_stage: str, _share: float) -> None:
    """Nobody waits for so little."""
