"""Choosing pairs that differ and cover."""

import numpy as np
import pytest

from fingersplit.parallel_grasps.spread_kernel import spread_pairs


def distances(first, second):
    straight = np.linalg.norm(first[:, None] - first, axis=2) + np.linalg.norm(second[:, None] - second, axis=2)
    swapped = np.linalg.norm(first[:, None] - second, axis=2) + np.linalg.norm(second[:, None] - first, axis=2)
    return 0.5 * np.minimum(straight, swapped)


def test_chosen_pairs_keep_their_distance_and_order():
    first, second = np.random.default_rng(0).uniform(size=(2, 400, 3))
    chosen = spread_pairs(first, second, 60, np.array([0.5, 0.3, 0.1]))
    assert (np.diff(chosen) > 0).all()
    apart = distances(first[chosen], second[chosen])
    assert apart[np.triu_indices(len(chosen), 1)].min() >= 0.1
    left_out = np.setdiff1d(np.arange(400), chosen)
    if len(chosen) < 60:
        assert (distances(first, second)[left_out][:, chosen].min(axis=1) < 0.1).all()


def test_best_comes_first_and_swapped_ends_are_the_same_pair():
    first = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1.0]])
    second = np.array([[1, 0, 0], [0, 0, 0], [0, 0, 2.0]])
    assert spread_pairs(first, second, 3, np.array([0.5, 0.1])).tolist() == [0, 2]
    assert spread_pairs(first, second, 1, np.array([0.5, 0.1])).tolist() == [0]
    assert spread_pairs(first[:0], second[:0], 3, np.array([0.5, 0.1])).tolist() == []


def test_far_pairs_come_before_near_better_ones():
    first = np.array([[0, 0, 0], [0.02, 0, 0], [1.0, 0, 0]])
    second = first + np.eye(3)[1]
    assert spread_pairs(first, second, 2, np.array([0.5, 0.01])).tolist() == [0, 2]
    assert spread_pairs(first, second, 3, np.array([0.5, 0.01])).tolist() == [0, 1, 2]


@pytest.mark.parametrize("count", [1, 5, 50])
def test_never_more_than_asked_for(count):
    first, second = np.random.default_rng(1).uniform(size=(2, 100, 3))
    assert len(spread_pairs(first, second, count, np.array([0.3, 1e-3]))) == count
