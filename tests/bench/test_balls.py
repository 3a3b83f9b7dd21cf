"""The share of feasible starts over the size of an object."""

from fingersplit.objects.parametric import sphere
from fingersplit_bench.balls import feasible_shares, gaps


def test_gaps_are_sizes_without_a_grasp_between_others():
    assert gaps([1, 2, 3, 4, 5, 6], [0.0, 0.2, 0.0, 0.0, 0.9, 0.0]) == [3, 4]
    assert gaps([1, 2], [0.0, 0.0]) == []
    assert gaps([1, 2, 3], [0.5, 0.1, 1.0]) == []


def test_shares_are_those_of_each_hand(barrett):
    shares = feasible_shares([barrett], lambda size: sphere(size / 2000), [50, 500], 8)
    assert shares["barrett"][0] > 0.5
    assert shares["barrett"][1] == 0.0  # nothing opens that wide
