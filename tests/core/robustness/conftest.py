"""Grasps to be judged, and how they are executed."""

from collections.abc import Callable
from functools import cache

import pytest

from fingersplit.hands import Hand
from fingersplit.objects.convex_pieces import ConvexPieces, decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.search import Search, find_grasps
from fingersplit.robustness.execution import Execution
from fingersplit.robustness.features import Candidate

Judgeable = tuple[Search, ConvexPieces, list[tuple[Candidate, Execution]]]


@pytest.fixture(scope="session")
def judgeable(barrett: Hand, prepared: Callable[[str], ObjectModel]) -> Callable[[str], Judgeable]:
    """Feasible grasps of a parametric object, its pieces, and the grasps as they are judged."""

    @cache
    def make(name: str) -> Judgeable:
        model = prepared(name)
        found = find_grasps(model, barrett, starts=16, seed=1, top_k=4)
        candidates = []
        for one in found.grasps:
            if one.run.feasible:
                grasp, grip, opened = one.run.final, one.execution.grip, one.execution.pregrasp_joints
                parts = opened, grasp.joints, grip.targets, grip.stiffness, grip.damping
                candidates.append((Candidate(grasp, opened, one.holding), Execution(grasp.object_from_palm, *parts)))
        return found, decompose(model.mesh, 32, 5_000), candidates

    return make
