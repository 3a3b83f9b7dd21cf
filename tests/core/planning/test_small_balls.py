"""Balls whose diameter is about twice the distance of the pads from the spread axis were the Map's blind spot."""

import re

import pytest

from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import box, sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps


@pytest.mark.parametrize("diameter", [24, 30, 33, 36, 40, 44])
def test_most_starts_on_a_small_ball_are_feasible(barrett, diameter):
    """Before pads were turned to face the surface, 2 to 5 of 64 starts on balls of 30 to 39 mm were."""
    ball = prepare_object(sphere(diameter / 2000), f"ball of {diameter} mm")
    runs = find_grasps(ball, barrett, starts=32, seed=0, top_k=1).runs
    assert sum(run.feasible for run in runs) >= 0.7 * len(runs)


@pytest.mark.parametrize("thickness", [0.2, 0.37, 0.76, 1.3, 2.1, 3.0])
def test_cards_are_pinched_however_thin(barrett, thickness):
    card = prepare_object(box((85.6e-3, 54e-3, thickness / 1000)), f"card of {thickness} mm")
    assert any(run.feasible for run in find_grasps(card, barrett, starts=64, seed=0, top_k=1).runs)


@pytest.mark.parametrize("diameter", [18, 40])
def test_what_is_too_small_for_a_hand_is_told(diameter):
    """Two fingers of this hand stay 52 mm apart: their pads reach beside a small ball."""
    ball = prepare_object(sphere(diameter / 2000), f"ball of {diameter} mm")
    message = plan(ball, load_hand("three_finger"), starts=12).message
    assert f"The object is {diameter} mm in its largest extent" in message
    assert "stayed 52 mm apart in every start: it is too small for this hand" in message
    assert "more starts" not in message


def test_a_needle_is_told_what_the_nearest_start_lacks():
    needle = prepare_object(box((0.06, 0.001, 0.001)), "needle")
    message = plan(needle, load_hand("three_finger"), starts=8, seed=1).message
    assert message.startswith("None of ")
    assert re.search(r"What the nearest of them lacks: The pad of .* allowed: [\d.]+ (mm|rad)\.", message)
