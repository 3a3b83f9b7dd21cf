"""Attempts to find feasible grasps: more starts, other grips, what would have to be relaxed, and refinement."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from fingersplit.contacts.holding import Holding
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.final_checks import check_finally
from fingersplit.planning.finding import allowed_starts, find_starts
from fingersplit.planning.ranking import rank_runs
from fingersplit.planning.refining import candidate_of, holdings_of, refine_runs
from fingersplit.planning.relaxing import Relaxation, find_relaxations
from fingersplit.planning.run import Run
from fingersplit.planning.starts import build_problem, choose_starts, split_starts
from fingersplit.robustness.judging import estimate_holding
from fingersplit.robustness.noise import NoiseModel
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene, prepare_scene
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.threads import Progress

__all__ = ["Asked", "Found", "Watch", "refined", "relaxed_constraints", "search", "silent"]

ATTEMPTS, MORE_STARTS = 3, 3
"""A request with a scene is tried again when nothing is feasible, so often in all, each time with more starts."""
CARRYING_STARTS = 4
"""Any request is tried again when no feasible grasp carries the object's weight, each time with as many starts as it
had, until one does or it had so many times the starts that were asked for."""
PROMISING = 0.75
"""Estimated probability of holding that one of these must have where there is time to simulate the best, too."""

REFINED = 12
"""Best grasps that are refined on request."""


@dataclass(frozen=True, eq=False)
class Asked:
    """What a request asks for, and who is told how far it is; as the arguments of `find_grasps`."""

    model: ObjectModel
    given: Sequence[ParallelGrasp] | None
    source: str
    starts: int
    seed: int
    settings: PlannerSettings
    friction: float
    constraints: Constraints
    threads: int
    report: Progress
    watch: "Watch"
    ranking: RankingOrder

    def scene_of(self, hand: Hand) -> PreparedScene:
        """The scene as it is for one grip."""
        return prepare_scene(self.constraints, self.model, hand)


@dataclass(frozen=True, eq=False)
class Found:
    """What a search with one grip found.

    Attributes:
        hand: The grip.
        scene: As it is for that grip.
        starts: Most runs that there might be.
        parallel_grasps: How many were there to start from last.
        runs: Every finished run.
        holdings: How the runs' grasps hold the object.
    """

    hand: Hand
    scene: PreparedScene
    starts: int
    parallel_grasps: int
    runs: tuple[Run, ...]
    holdings: list[Holding]

    @property
    def feasible(self) -> bool:
        """Whether any run ended in a feasible grasp."""
        return any(run.feasible for run in self.runs)


def search(asked: Asked, grips: Sequence[Hand]) -> Found:
    """Search with the first grip, with more starts where they may help, then with the others if nothing is feasible."""
    found = _attempt(asked, grips[0], asked.scene_of(grips[0]), asked.starts, asked.seed)
    for attempt in range(1, ATTEMPTS if asked.given is None else 1):
        count = _more_starts(asked, found, attempt)
        if not count:
            break
        more = _attempt(asked, found.hand, found.scene, count, [asked.seed, attempt])
        found = replace(
            more,
            starts=found.starts + count,
            runs=found.runs + more.runs,
            holdings=found.holdings + more.holdings,
        )
    for grip in grips[1:]:
        if found.feasible:
            break
        other = _attempt(asked, grip, asked.scene_of(grip), asked.starts, asked.seed)
        found = other if other.feasible else found
    return found


def _attempt(asked: Asked, hand: Hand, scene: PreparedScene, count: int, seeds: int | list[int]) -> Found:
    """Runs from new starts, and how their grasps hold the object."""
    parallel_grasps, runs = _run(asked, hand, scene, count, seeds)
    holdings = holdings_of(runs, asked.model, asked.friction, asked.threads)
    asked.watch.lap("ranking")
    return Found(hand, scene, count, parallel_grasps, runs, holdings)


def _run(
    asked: Asked, hand: Hand, scene: PreparedScene, count: int, seeds: int | list[int]
) -> tuple[int, tuple[Run, ...]]:
    """Parallel grasps, the most promising starts from them, and their splitting: how many there were, and the runs."""
    model, threads, report, watch = asked.model, asked.threads, asked.report, asked.watch
    report("parallel_grasps", 0.0)
    given: Sequence[ParallelGrasp]
    if asked.given is None:
        rng = np.random.default_rng(seeds)
        given = find_starts(
            model, hand, scene, count, source=asked.source, friction=asked.friction, rng=rng, threads=threads
        )
    else:
        given = allowed_starts(asked.given, scene)
    watch.lap("parallel_grasps")
    problem = build_problem(model, hand, asked.settings, scene)
    chosen = choose_starts(problem, hand, given, count, threads=threads, report=report)
    watch.lap("mapping")
    runs = split_starts(problem, model.patches, hand, chosen, threads=threads, report=report, scene=scene)
    check_finally(runs, scene, model)
    watch.lap("splitting")
    return len(given), runs


def _more_starts(asked: Asked, found: Found, attempt: int) -> int:
    """How many to go on with: where obstacles leave nothing feasible, or what is feasible cannot carry the object."""
    if not found.feasible:
        return asked.starts * MORE_STARTS**attempt if found.scene.restricts else 0
    enough = found.starts >= CARRYING_STARTS * asked.starts
    return 0 if enough or _is_promising(asked, found) else found.starts


def _is_promising(asked: Asked, found: Found) -> bool:
    """Whether a grasp carries the object, and is likely enough to hold it where there is time to find out."""
    pairs = zip(found.runs, found.holdings, strict=True)
    carrying = [candidate_of(run, holding) for run, holding in pairs if run.feasible and holding.margin >= 0.0]
    if not (carrying and asked.ranking.simulation_budget):
        return bool(carrying)
    noise = asked.ranking.noise
    values = estimate_holding(found.hand, asked.model, carrying, asked.friction, noise, asked.threads)
    return bool(values.max() >= PROMISING)


def relaxed_constraints(asked: Asked, found: Found) -> tuple[Relaxation, ...]:
    """What would leave grasps if it were relaxed, where a scene leaves none."""
    if found.feasible or not found.scene.restricts:
        return ()
    asked.report("relaxing", 0.0)

    def relaxed(wanted: Constraints) -> Sequence[Run]:
        other = replace(asked, constraints=wanted, report=silent, watch=Watch())
        return _run(other, found.hand, other.scene_of(found.hand), asked.starts, asked.seed)[1]

    relaxations = find_relaxations(found.scene, found.runs, relaxed)
    asked.watch.lap("splitting")
    return relaxations


def refined(asked: Asked, found: Found, noise: NoiseModel) -> Found:
    """The same with the best runs refined."""
    model, friction, threads = asked.model, asked.friction, asked.threads
    ranked = rank_runs(model, found.runs, found.holdings, REFINED, friction, threads, RankingOrder(noise=noise))
    best = [one.run for one in ranked if one.run.feasible]
    better = dict(zip(map(id, best), refine_runs(best, model, friction, noise), strict=True))
    runs = tuple(better.get(id(run), run) for run in found.runs)
    return replace(found, runs=runs, holdings=holdings_of(runs, model, friction, threads))


def silent(_stage: str, _share: float) -> None:
    """Nobody waits."""


class Watch:
    """Time since the last lap, by stage.

    Attributes:
        seconds: By stage [s].
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._since = perf_counter()

    def lap(self, stage: str) -> None:
        """Count the time since the last lap for a stage."""
        now = perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._since
        self._since = now
