"""From finished runs to an answer: the ranked grasps, and one sentence on how it went."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.plan import PlannedGrasp
from fingersplit.quality.assessment import assess
from fingersplit.quality.forces import holding_forces
from fingersplit.quality.metrics import WrenchSpace
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.starts import Run

__all__ = ["describe_outcome", "rank_runs"]

SAME_POSITION, SAME_ROTATION = 5e-3, 0.1
"""Palms nearer than this are one grasp, of which the better stays [m], [rad]."""


def rank_runs(
    model: ObjectModel, runs: Sequence[Run], top_k: int, settings: PlannerSettings
) -> tuple[PlannedGrasp, ...]:
    """The best ``top_k`` runs that are not nearly a better one, with their metrics and holding forces.

    Fewest violated constraints first, so feasible grasps lead; then Ferrari-Canny metric, then Q.
    """
    candidates = []
    for run in runs:
        space = WrenchSpace(
            run.final.contacts, run.final.normals, settings.friction, model.center_of_mass, model.radius
        )
        candidates.append((run, space, assess(space, run.scores)))
    candidates.sort(key=lambda c: (len(c[0].violations), -c[2].ferrari_canny, -c[2].quality))
    kept: list[PlannedGrasp] = []
    for run, space, metrics in candidates:
        if len(kept) == top_k:
            break
        if not any(_nearly_same(run, better.run) for better in kept):
            kept.append(PlannedGrasp(len(kept) + 1, run, metrics, holding_forces(space, model.mass)))
    return tuple(kept)


def _nearly_same(a: Run, b: Run) -> bool:
    """Whether two grasps put the hand in nearly the same place."""
    between = np.linalg.inv(a.final.object_from_palm) @ b.final.object_from_palm
    angle = math.acos(min(1.0, max(-1.0, (np.trace(between[:3, :3]) - 1) / 2)))
    return bool(np.linalg.norm(between[:3, 3]) < SAME_POSITION and angle < SAME_ROTATION)


def describe_outcome(grasps: int, runs: Sequence[Run], hand: Hand, settings: PlannerSettings) -> str:
    """One sentence on how the runs that came of ``grasps`` parallel grasps ended; why none is feasible, if none is."""
    feasible = sum(run.feasible for run in runs)
    if feasible:
        return f"{feasible} of {len(runs)} starts ended in a feasible grasp."
    if grasps == 0:
        low, high = (1e3 * x for x in hand.gripper.opening)
        return (
            f"No parallel grasp exists to start from: no two opposite surface points lie inside each other's friction "
            f"cones (friction {settings.friction:g}) within the hand's opening of {low:g} to {high:g} mm."
        )
    if not runs:
        return (
            f"None of the {grasps} parallel grasps could be taken over by the hand: no standoff brings all fingertips "
            f"within reach of the surface next to the two contacts."
        )
    ends = Counter(run.termination for run in runs)
    reasons = ", ".join(f"{count} {end.label.replace('_', ' ')}" for end, count in ends.most_common())
    return f"None of {len(runs)} starts ended in a feasible grasp: {reasons}. {ends.most_common(1)[0][0].advice}"
