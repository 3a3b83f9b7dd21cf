"""Planned grasps of small objects with the pieces that a simulation collides."""

from collections.abc import Callable
from functools import cache

import pytest

from fingersplit.hands import Hand
from fingersplit.objects.convex_pieces import ConvexPieces, decompose
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.search import Search, find_grasps


@pytest.fixture(scope="session")
def planned(barrett: Hand, prepared: Callable[[str], ObjectModel]) -> Callable[[str], tuple[Search, ConvexPieces]]:
    """The grasps of a parametric object, and its pieces."""

    @cache
    def make(name: str) -> tuple[Search, ConvexPieces]:
        model = prepared(name)
        return find_grasps(model, barrett, starts=16, seed=1, top_k=4), decompose(model.mesh, 32, 5_000)

    return make
