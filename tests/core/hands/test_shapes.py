"""Signed distances of the primitive shapes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.hands.shapes import BOX, CAPSULE, CYLINDER, SPHERE, bounding_radius, shape_distance, shape_mesh

SIZES = {
    SPHERE: np.array([0.02, 0.0, 0.0]),
    CAPSULE: np.array([0.01, 0.03, 0.0]),
    CYLINDER: np.array([0.04, 0.015, 0.0]),
    BOX: np.array([0.03, 0.02, 0.01]),
}
KINDS = pytest.mark.parametrize("kind", SIZES)
seeds = st.integers(0, 2**32 - 1)


def distance(kind, points) -> np.ndarray:
    return np.array([shape_distance(kind, SIZES[kind], *point) for point in np.asarray(points, dtype=float)])


def surface_points(kind, count, rng) -> np.ndarray:
    """Points on the shape's surface, from its definition."""
    radius, half, _ = SIZES[kind]
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    if kind == SPHERE:
        return radius * directions
    if kind == CAPSULE:
        around = directions * (1, 1, 0)
        on_side = radius * around / np.linalg.norm(around, axis=1, keepdims=True)
        on_side[:, 2] = rng.uniform(-half, half, count)
        on_cap = radius * directions + half * np.sign(directions[:, 2:]) * (0, 0, 1)
        return np.where(rng.random((count, 1)) < 0.5, on_side, on_cap)
    if kind == CYLINDER:
        turn, out = rng.uniform(0, 2 * np.pi, count), radius * np.sqrt(rng.random(count))
        on_side = rng.random(count) < 0.5
        out = np.where(on_side, radius, out)
        height = np.where(on_side, rng.uniform(-half, half, count), half * rng.choice([-1, 1], count))
        return np.stack([out * np.cos(turn), out * np.sin(turn), height], axis=1)
    points = rng.uniform(-1, 1, (count, 3))
    face = rng.integers(3, size=count)
    points[np.arange(count), face] = rng.choice([-1, 1], count)
    return points * SIZES[kind]


@KINDS
def test_zero_on_the_surface(kind):
    points = surface_points(kind, 500, np.random.default_rng(0))
    assert np.abs(distance(kind, points)).max() < 1e-15


@KINDS
def test_negative_inside_and_positive_outside(kind):
    points = surface_points(kind, 500, np.random.default_rng(1))
    assert (distance(kind, 0.999 * points) < 0).all()  # the shapes are convex about their centres
    assert (distance(kind, 1.001 * points) > 0).all()


@KINDS
@given(seed=seeds)
def test_distance_is_that_to_the_nearest_surface_point(kind, seed):
    query = np.random.default_rng(seed).uniform(-0.05, 0.05, 3)
    surface = surface_points(kind, 20_000, np.random.default_rng(2))
    brute_force = np.linalg.norm(surface - query, axis=1).min()
    found = abs(distance(kind, [query])[0])
    assert found <= brute_force + 1e-12
    assert found >= brute_force - 2e-3


@KINDS
@given(seed=seeds)
def test_distance_grows_no_faster_than_the_way(kind, seed):
    a, b = np.random.default_rng(seed).uniform(-0.08, 0.08, (2, 3))
    difference = distance(kind, [a])[0] - distance(kind, [b])[0]
    assert abs(difference) <= np.linalg.norm(a - b) + 1e-15


@KINDS
def test_bounding_sphere_encloses_and_touches(kind):
    points = surface_points(kind, 5_000, np.random.default_rng(3))
    farthest = np.linalg.norm(points, axis=1).max()
    radius = bounding_radius(kind, SIZES[kind])
    assert farthest <= radius + 1e-15
    assert farthest >= 0.97 * radius


@KINDS
def test_drawing_is_closed_and_lies_on_the_shape(kind):
    mesh = shape_mesh(kind, SIZES[kind])
    assert mesh.is_watertight
    assert np.abs(distance(kind, mesh.vertices)).max() < 1e-9
