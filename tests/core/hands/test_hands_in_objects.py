"""No feasible grasp of any hand lies deeper than a millimetre in the object or in itself, by MuJoCo's solids."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingersplit.hands import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.scatter import scatter
from fingersplit.planning.search import find_grasps
from known_hands import KNOWN_HANDS, known_hand
from posed_solids import PosedSolids

DEEPEST = 1e-3
"""[m]"""
ROUNDING = 1e-5
"""[m]; the planner's own search for the deepest point ends so near."""


def check(model: ObjectModel, hand: Hand, starts: int, points: int) -> int:
    """Look at every feasible run, and count them."""
    solids, looked_at = PosedSolids(hand), 0
    surface = cKDTree(scatter(model.mesh, points, np.random.default_rng(5))[0])
    for run in find_grasps(model, hand, starts=starts, seed=7).runs:
        if run.feasible:
            solids.move(run.final.joints)
            depth, link = solids.depth_in(surface, run.final.object_from_palm)
            assert depth < DEEPEST + ROUNDING, f"{model.name} in {link}"
            own, links = solids.depth_in_itself()
            assert own < DEEPEST + ROUNDING, links
            looked_at += 1
    return looked_at


@pytest.mark.parametrize("name", KNOWN_HANDS)
def test_feasible_grasps_lie_in_nothing(name, prepared, monkeypatch):
    hand = known_hand(name, monkeypatch)
    assert check(prepared("l_bracket"), hand, 16, 20_000) + check(prepared("sphere"), hand, 16, 20_000) > 3


@pytest.mark.campaign
@pytest.mark.parametrize("name", KNOWN_HANDS)
def test_feasible_grasps_of_every_object_lie_in_nothing(every_object, name, monkeypatch):
    check(every_object, known_hand(name, monkeypatch), 64, 100_000)
