"""Planned grasps of small objects with the pieces that a simulation collides."""

from collections.abc import Callable
from functools import cache

import pytest

from fingersplit.hands import Hand
from fingersplit.objects.convex_pieces import ConvexPieces, decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.plan import Plan
from fingersplit.planning.planning import plan


@pytest.fixture(scope="session")
def planned(barrett: Hand, prepared: Callable[[str], ObjectModel]) -> Callable[[str], tuple[Plan, ConvexPieces]]:
    """The plan of a parametric object, and its pieces."""

    @cache
    def make(name: str) -> tuple[Plan, ConvexPieces]:
        model = prepared(name)
        return plan(model, barrett, starts=16, seed=1, top_k=4), decompose(model.mesh, 32, 5_000)

    return make
