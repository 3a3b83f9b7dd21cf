"""Many starts: parallel grasps screened for the hand, the most promising ones mapped and split."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.patches import Patches
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.batch_kernel import screen_grasps, split_grasps
from fingersplit.planning.outcome import OUTCOME
from fingersplit.planning.run import Run
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene, prepare_scene
from fingersplit.splitting.jaw_table import jaw_table
from fingersplit.splitting.mapping_kernel import REFINED
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.state import Problem, new_states, new_work
from fingersplit.splitting.trace import new_trace
from fingersplit.threads import Progress, in_threads

__all__ = ["Start", "build_problem", "choose_starts", "split_starts"]

SCREENED, SPLIT = 32, 4
"""Fewest parallel grasps that a thread screens, and starts that it splits, at a time."""


@dataclass(frozen=True, eq=False)
class Start:
    """A parallel grasp that the hand is to take over.

    Attributes:
        parallel_grasp: The two contacts and the approach.
        contacts: The same contacts, that of the fingers in group 0 first, (2, 3) [m].
        choices: Preshape and standoff to try first, and second, (REFINED, 2).
    """

    parallel_grasp: ParallelGrasp
    contacts: NDArray[np.float64]
    choices: NDArray[np.int64]


def build_problem(
    model: ObjectModel, hand: Hand, settings: PlannerSettings, scene: PreparedScene | None = None
) -> Problem:
    """Everything the search reads, in one tuple; without ``scene``, the default approach and nothing around."""
    scene = scene or prepare_scene(Constraints(), model, hand)
    x, y, z = model.center_of_mass.tolist()
    return Problem(
        hand=hand.arrays,
        settings=settings.for_kernels(),
        surface=model.surface,
        collision=model.collision,
        distance=model.distance,
        center=(x, y, z),
        limits=scene.limits,
        scene=scene.arrays,
    )


def choose_starts(
    problem: Problem, hand: Hand, grasps: Sequence[ParallelGrasp], count: int, *, threads: int, report: Progress
) -> list[Start]:
    """Screen every parallel grasp with both finger assignments and keep the ``count`` most promising starts.

    A pair of contacts that already has a start in the list must do better to get another one, so the starts spread
    over the object. Grasps that the hand cannot reach are left out.
    """
    if not grasps:
        return []
    given = grasps if isinstance(grasps, ParallelGrasps) else ParallelGrasps.from_grasps(grasps)
    contacts = np.concatenate([given.contacts, given.contacts[:, ::-1]])
    approaches = np.tile(given.approaches, (2, 1))
    costs, choices = np.empty((len(contacts), REFINED)), np.empty((len(contacts), REFINED, 2), np.int64)

    def screen(part: slice) -> None:
        arrays = contacts[part], approaches[part]
        screen_grasps(problem, jaw_table(hand), *arrays, new_states(1), new_work(), costs[part], choices[part])

    in_threads(screen, len(contacts), SCREENED, threads, lambda share: report("mapping", share))
    best = _spread(costs[:, 0], given.contacts, count)
    return [Start(grasps[i % len(grasps)], contacts[i], choices[i]) for i in best]


def _spread(costs: NDArray[np.float64], pairs: NDArray[np.float64], count: int) -> list[int]:
    """Indices of the ``count`` lowest costs, each multiplied by how often its pair of contacts was met before."""
    whole = np.ascontiguousarray(pairs).reshape(len(pairs), -1).view(np.dtype((np.void, pairs[0].nbytes)))
    _, pair_of_grasp = np.unique(whole[:, 0], return_inverse=True)
    order = np.argsort(costs, kind="stable")
    order = order[np.isfinite(costs[order])]
    pair = pair_of_grasp[order % len(pairs)]
    by_pair = np.argsort(pair, kind="stable")
    uses = np.empty(len(order))
    uses[by_pair] = 1 + np.arange(len(order)) - np.searchsorted(pair[by_pair], pair[by_pair])
    chosen: list[int] = order[np.argsort(costs[order] * uses, kind="stable")[:count]].tolist()
    return chosen


def split_starts(
    problem: Problem,
    patches: Patches,
    hand: Hand,
    starts: Sequence[Start],
    *,
    threads: int,
    report: Progress,
    scene: PreparedScene | None = None,
) -> tuple[Run, ...]:
    """Map and split every start; one that the hand turns out not to reach is left out.

    ``scene`` is that of the problem, for the runs to name its obstacles.
    """
    count = len(starts)
    contacts = np.array([start.contacts for start in starts]).reshape(-1, 2, 3)
    approaches = np.array([start.parallel_grasp.approach for start in starts]).reshape(-1, 3)
    choices = np.array([start.choices for start in starts], np.int64).reshape(-1, REFINED, 2)
    initial, final, outcomes = new_states(count), new_states(count), np.rec.array(np.zeros(count, OUTCOME))

    def split(part: slice) -> None:
        arrays = contacts[part], approaches[part], choices[part], initial[part], final[part], outcomes[part]
        split_grasps(problem, patches, jaw_table(hand), *arrays, new_states(3), new_work(), new_trace(0))

    in_threads(split, count, SPLIT, threads, lambda share: report("splitting", share))
    return tuple(
        Run(problem, hand, start.parallel_grasp, first, last, outcome, scene)
        for start, first, last, outcome in zip(starts, initial, final, outcomes, strict=True)
        if math.isfinite(outcome.cost)
    )
