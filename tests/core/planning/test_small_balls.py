"""Balls whose diameter is about twice the distance of the pads from the spread axis were the Map's blind spot."""

import pytest

from fingersplit.objects.parametric import sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps


@pytest.mark.parametrize("diameter", [24, 30, 33, 36, 40, 44])
def test_most_starts_on_a_small_ball_are_feasible(barrett, diameter):
    """Before pads were turned to face the surface, 2 to 5 of 64 starts on balls of 30 to 39 mm were."""
    ball = prepare_object(sphere(diameter / 2000), f"ball of {diameter} mm")
    runs = find_grasps(ball, barrett, starts=32, seed=0, top_k=1).runs
    assert sum(run.feasible for run in runs) >= 0.7 * len(runs)
