"""Q_o and Q_h: known values, gradients against finite differences, invariances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.splitting.objective_kernel import (
    manipulability,
    manipulability_gradient,
    object_quality,
    object_quality_gradient,
)

seeds = st.integers(0, 2**32 - 1)
counts = st.sampled_from([3, 4, 5])


def finite_differences(function, at: np.ndarray, step: float) -> np.ndarray:
    slopes = np.empty(at.size)
    for k in range(at.size):
        move = step * np.eye(at.size)[k].reshape(at.shape)
        slopes[k] = (function(at + move) - function(at - move)) / (2 * step)
    return slopes.reshape(at.shape)


def test_object_quality_is_twice_the_area_of_the_triangle():
    triangle = np.array([[0, 0, 0], [0.03, 0, 0], [0, 0.04, 0.0]])
    assert object_quality(triangle, 3) == pytest.approx(0.03 * 0.04)


def test_object_quality_of_four_is_the_mean_over_triples():
    square = 0.05 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    assert object_quality(square, 4) == pytest.approx(0.05**2)


@given(seeds, counts)
def test_gradient_of_object_quality_agrees_with_finite_differences(seed, count):
    contacts = np.random.default_rng(seed).uniform(-0.05, 0.05, (count, 3))
    gradient = np.full((count, 3), np.nan)
    object_quality_gradient(contacts, count, gradient)
    slopes = finite_differences(lambda c: object_quality(c, count), contacts, 1e-7)
    np.testing.assert_allclose(gradient, slopes, atol=1e-7)


@given(seeds)
def test_contacts_beyond_the_count_play_no_part(seed):
    contacts = np.random.default_rng(seed).uniform(-0.05, 0.05, (5, 3))
    padded, exact = np.full((5, 3), np.nan), np.full((3, 3), np.nan)
    object_quality_gradient(contacts, 3, padded)
    object_quality_gradient(contacts[:3].copy(), 3, exact)
    assert object_quality(contacts, 3) == object_quality(contacts[:3].copy(), 3)
    np.testing.assert_array_equal(padded[:3], exact)
    np.testing.assert_array_equal(padded[3:], 0)


@given(seeds, counts)
def test_object_quality_depends_on_shape_alone(seed, count):
    rng = np.random.default_rng(seed)
    contacts = rng.uniform(-0.05, 0.05, (count, 3))
    quality = object_quality(contacts, count)
    moved = contacts @ Rotation.random(rng=rng).as_matrix().T + rng.normal(size=3)
    assert object_quality(moved, count) == pytest.approx(quality, rel=1e-9)
    assert object_quality(rng.permutation(contacts), count) == pytest.approx(quality, rel=1e-12)
    assert object_quality(2 * contacts, count) == pytest.approx(4 * quality, rel=1e-12)


def test_gradient_without_area_is_zero():
    gradient = np.full((3, 3), np.nan)
    object_quality_gradient(np.array([[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0.0]]), 3, gradient)
    np.testing.assert_array_equal(gradient, 0)


def test_manipulability_is_zero_at_mid_range_and_minus_an_eighth_per_joint_at_a_limit(barrett):
    middle = (barrett.lower + barrett.upper) / 2
    assert manipulability(barrett.arrays, middle) == 0
    assert manipulability(barrett.arrays, barrett.lower) == pytest.approx(-8 / 8)
    one_at_limit = middle.copy()
    one_at_limit[3] = barrett.upper[3]
    assert manipulability(barrett.arrays, one_at_limit) == pytest.approx(-1 / 8)


@given(seed=seeds)
def test_gradient_of_manipulability_agrees_with_finite_differences(barrett, seed):
    joints = np.random.default_rng(seed).uniform(barrett.lower, barrett.upper)
    gradient = np.empty(8)
    manipulability_gradient(barrett.arrays, joints, gradient)
    slopes = finite_differences(lambda q: manipulability(barrett.arrays, q), joints, 1e-6)
    np.testing.assert_allclose(gradient, slopes, atol=1e-9)
