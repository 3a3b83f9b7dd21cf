"""The whole way on one screen: object and hand, parallel grasps, starts, finger splitting, ranked grasps."""

from collections.abc import Sequence
from dataclasses import dataclass

from fingersplit.contacts.friction import planned_friction
from fingersplit.errors import SettingsError
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.on_surface import check_on_surface
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.attempts import Asked, Found, Watch, refined, relaxed_constraints, search, silent
from fingersplit.planning.ranking import RankedGrasp, describe_outcome, rank_runs
from fingersplit.planning.relaxing import Relaxation
from fingersplit.planning.run import Run
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit.scene.attaching import attach_bodies
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.threads import Progress

__all__ = ["Search", "find_grasps"]

_NOTHING_LEFT = (
    "No parallel grasp is left to start from: what stands around the object, approach.directions, the palm's limits "
    "and contact_regions rule out all that were found."
)


@dataclass(frozen=True, eq=False)
class Search:
    """Every run of a request and the best of them, as arrays and kernel records.

    Attributes:
        model: The object.
        hand: The hand.
        settings: Parameters of the splitting.
        friction: Coulomb friction between pads and object that was planned for.
        constraints: What the grasps had to keep to.
        scene: The same, prepared for the object and the hand.
        relaxations: What would leave grasps if it were relaxed; empty unless nothing is feasible in a scene.
        starts: Most runs that there might be: more than were asked for where the search went on.
        runs: Every finished run, in the order of the starts.
        grasps: The best of them, best first.
        message: One sentence on how it went.
        seconds: Time by stage [s]: parallel grasps, mapping, splitting, ranking.
    """

    model: ObjectModel
    hand: Hand
    settings: PlannerSettings
    friction: float
    constraints: Constraints
    scene: PreparedScene
    relaxations: tuple[Relaxation, ...]
    starts: int
    runs: tuple[Run, ...]
    grasps: tuple[RankedGrasp, ...]
    message: str
    seconds: dict[str, float]

    @property
    def feasible(self) -> int:
        """Number of runs that ended in a feasible grasp."""
        return sum(run.feasible for run in self.runs)


def find_grasps(
    model: ObjectModel,
    hand: Hand,
    parallel_grasps: Sequence[ParallelGrasp] | None = None,
    *,
    source: str = "antipodal",
    starts: int = 64,
    seed: int = 0,
    top_k: int = 10,
    settings: PlannerSettings | None = None,
    friction: float | None = None,
    constraints: Constraints | None = None,
    ranking: RankingOrder | None = None,
    refine: bool = False,
    threads: int = 1,
    progress: Progress | None = None,
) -> Search:
    """What ``planning.plan`` does, with every run; arguments and errors are the same."""
    _check(starts=starts, top_k=top_k, threads=threads, seed=seed)
    settings = settings or PlannerSettings()
    friction = planned_friction(friction, model.options.friction)
    constraints = constraints or Constraints()
    bodies = constraints.end_effector.attached_bodies
    grips = hand.grips if hand in hand.grips[:1] else (hand,)
    if parallel_grasps is not None:
        check_on_surface(model, parallel_grasps)
    asked = Asked(
        model=model,
        given=parallel_grasps,
        source=source,
        starts=starts,
        seed=seed,
        settings=settings,
        friction=friction,
        constraints=constraints,
        threads=threads,
        report=progress or silent,
        watch=Watch(),
        ranking=ranking or RankingOrder(),
    )
    found = search(asked, [attach_bodies(grip, bodies) for grip in grips])
    relaxations = relaxed_constraints(asked, found)
    if refine:
        asked.report("refining", 0.0)
        found = refined(asked, found, asked.ranking.noise)
        asked.watch.lap("splitting")
    grasps = rank_runs(model, found.runs, found.holdings, top_k, friction, threads, asked.ranking)
    asked.watch.lap("ranking")
    asked.report("ranking", 1.0)
    return Search(
        model=model,
        hand=found.hand,
        settings=settings,
        friction=friction,
        constraints=constraints,
        scene=found.scene,
        relaxations=relaxations,
        starts=found.starts,
        runs=found.runs,
        grasps=grasps,
        message=_message(asked, found, grasps, relaxations),
        seconds=asked.watch.seconds,
    )


def _message(asked: Asked, found: Found, grasps: Sequence[RankedGrasp], relaxations: Sequence[Relaxation]) -> str:
    """How it went, and what would help."""
    ruled_out = found.scene.restricts and asked.given is None and not found.parallel_grasps and not found.runs
    carries = any(one.run.feasible and one.carries_weight for one in grasps)
    outcome = describe_outcome(found.parallel_grasps, found.runs, found.hand, asked.friction, asked.model, carries)
    return " ".join((_NOTHING_LEFT if ruled_out else outcome, *(one.sentence for one in relaxations[:1])))


def _check(*, starts: int, top_k: int, threads: int, seed: int) -> None:
    for name, value, least in (("starts", starts, 1), ("top_k", top_k, 1), ("threads", threads, 1), ("seed", seed, 0)):
        if value < least:
            raise SettingsError(f"{name} is {value}; it must be at least {least}.")
