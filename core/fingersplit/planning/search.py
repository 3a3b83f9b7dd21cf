"""The whole way on one screen: object and hand, parallel grasps, starts, finger splitting, ranked grasps."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from fingersplit.contacts.friction import planned_friction
from fingersplit.contacts.holding import Holding
from fingersplit.errors import SettingsError
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.on_surface import check_on_surface
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.final_checks import check_finally
from fingersplit.planning.finding import allowed_starts, find_starts
from fingersplit.planning.ranking import RankedGrasp, describe_outcome, rank_runs
from fingersplit.planning.refining import holdings_of, refine_runs
from fingersplit.planning.relaxing import Relaxation, find_relaxations
from fingersplit.planning.run import Run
from fingersplit.planning.starts import build_problem, choose_starts, split_starts
from fingersplit.robustness.noise import NoiseModel
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit.scene.attaching import attach_bodies
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene, prepare_scene
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.threads import Progress

__all__ = ["Search", "find_grasps"]

ATTEMPTS, MORE_STARTS = 3, 3
"""A request with a scene is tried again when nothing is feasible, so often in all, each time with more starts; any
request once when no feasible grasp carries the object's weight."""

REFINED = 12
"""Best grasps that are refined on request."""

_NOTHING_LEFT = (
    "No parallel grasp is left to start from: what stands around the object, approach.directions, the palm's limits "
    "and contact_regions rule out all that were found."
)

_Found = tuple[Sequence[ParallelGrasp], tuple[Run, ...]]
"""Parallel grasps, and the runs that started from them."""


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
    report = progress or (lambda _stage, _share: None)
    seconds: dict[str, float] = {}
    watch = _Watch(seconds)

    constraints = constraints or Constraints()
    bodies = constraints.end_effector.attached_bodies
    others = [attach_bodies(grip, bodies) for grip in hand.grips[1:]] if hand in hand.grips[:1] else []
    hand = attach_bodies(hand, bodies)
    if parallel_grasps is not None:
        check_on_surface(model, parallel_grasps)

    def search(
        hand: Hand, scene: PreparedScene, count: int, seeds: int | list[int], watch: _Watch, report: Progress
    ) -> _Found:
        report("parallel_grasps", 0.0)
        given: Sequence[ParallelGrasp]
        if parallel_grasps is None:
            rng = np.random.default_rng(seeds)
            given = find_starts(model, hand, scene, count, source=source, friction=friction, rng=rng, threads=threads)
        else:
            given = allowed_starts(parallel_grasps, scene)
        watch.lap("parallel_grasps")
        problem = build_problem(model, hand, settings, scene)
        chosen = choose_starts(problem, hand, given, count, threads=threads, report=report)
        watch.lap("mapping")
        runs = split_starts(problem, model.patches, hand, chosen, threads=threads, report=report, scene=scene)
        check_finally(runs, scene, model)
        watch.lap("splitting")
        return given, runs

    scene = prepare_scene(constraints, model, hand)
    given, runs = search(hand, scene, starts, seed, watch, report)
    holdings, tried = holdings_of(runs, model, friction, threads), starts
    for attempt in range(1, ATTEMPTS if parallel_grasps is None else 1):
        if not _worth_more(runs, holdings, scene, attempt):
            break
        watch.lap("ranking")
        count = starts * MORE_STARTS**attempt
        given, more = search(hand, scene, count, [seed, attempt], watch, report)
        tried += count
        runs += more
        holdings += holdings_of(more, model, friction, threads)
    for grip in others:
        if any(run.feasible for run in runs):
            break
        around = prepare_scene(constraints, model, grip)
        found = search(grip, around, starts, seed, watch, report)
        if any(run.feasible for run in found[1]):
            hand, scene, (given, runs), tried = grip, around, found, starts
            holdings = holdings_of(runs, model, friction, threads)
    relaxations: tuple[Relaxation, ...] = ()
    if scene.restricts and not any(run.feasible for run in runs):
        report("relaxing", 0.0)

        def relaxed(wanted: Constraints) -> Sequence[Run]:
            return search(hand, prepare_scene(wanted, model, hand), starts, seed, _Watch({}), _silent)[1]

        relaxations = find_relaxations(scene, runs, relaxed)
        watch.lap("splitting")
    ruled_out = scene.restricts and parallel_grasps is None and not len(given) and not runs
    if refine:
        report("refining", 0.0)
        runs = _refined(runs, holdings, model, friction, (ranking or RankingOrder()).noise, threads)
        holdings = holdings_of(runs, model, friction, threads)
        watch.lap("splitting")
    grasps = rank_runs(model, runs, holdings, top_k, friction, threads, ranking)
    carries = any(one.run.feasible and one.carries_weight for one in grasps)
    watch.lap("ranking")
    report("ranking", 1.0)
    return Search(
        model=model,
        hand=hand,
        settings=settings,
        friction=friction,
        constraints=constraints,
        scene=scene,
        relaxations=relaxations,
        starts=tried,
        runs=runs,
        grasps=grasps,
        message=" ".join(
            (
                _NOTHING_LEFT if ruled_out else describe_outcome(len(given), runs, hand, friction, model, carries),
                *(relaxation.sentence for relaxation in relaxations[:1]),
            )
        ),
        seconds=seconds,
    )


def _worth_more(runs: Sequence[Run], holdings: Sequence[Holding], scene: PreparedScene, attempt: int) -> bool:
    """Whether to search on: nothing is feasible among obstacles, or what is feasible cannot carry the object."""
    margins = [holding.margin for run, holding in zip(runs, holdings, strict=True) if run.feasible]
    return (attempt == 1 and max(margins) < 0.0) if margins else scene.restricts


def _refined(
    runs: tuple[Run, ...],
    holdings: Sequence[Holding],
    model: ObjectModel,
    friction: float,
    noise: NoiseModel,
    threads: int,
) -> tuple[Run, ...]:
    """The runs with the best of them refined."""
    ranked = rank_runs(model, runs, holdings, REFINED, friction, threads, RankingOrder(noise=noise))
    best = [one.run for one in ranked if one.run.feasible]
    refined = dict(zip(map(id, best), refine_runs(best, model, friction, noise), strict=True))
    return tuple(refined.get(id(run), run) for run in runs)


def _silent(_stage: str, _share: float) -> None:
    """Nobody waits for a search that is only to tell why another one failed."""


def _check(*, starts: int, top_k: int, threads: int, seed: int) -> None:
    for name, value, least in (("starts", starts, 1), ("top_k", top_k, 1), ("threads", threads, 1), ("seed", seed, 0)):
        if value < least:
            raise SettingsError(f"{name} is {value}; it must be at least {least}.")


class _Watch:
    """Time since the last lap, by stage."""

    def __init__(self, seconds: dict[str, float]) -> None:
        self._seconds, self._since = seconds, perf_counter()

    def lap(self, stage: str) -> None:
        now = perf_counter()
        self._seconds[stage] = self._seconds.get(stage, 0.0) + now - self._since
        self._since = now
