"""The primitive shapes: signed distances and their gradients, covering spheres, drawings."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.hands.shapes import bounding_radius, covering_spheres, shape_mesh
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CYLINDER, SPHERE, shape_distance, shape_distance_gradient

SIZES = {
    SPHERE: np.array([0.02, 0.0, 0.0]),
    CAPSULE: np.array([0.01, 0.03, 0.0]),
    CYLINDER: np.array([0.04, 0.015, 0.0]),
    BOX: np.array([0.03, 0.02, 0.01]),
}
KINDS = pytest.mark.parametrize("kind", SIZES)
seeds = st.integers(0, 2**32 - 1)


def distance(kind, points, size=None) -> np.ndarray:
    size = SIZES[kind] if size is None else size
    return np.array([shape_distance(kind, size, *point) for point in np.asarray(points, dtype=float)])


def gradient(kind, point) -> np.ndarray:
    return np.array(shape_distance_gradient(kind, SIZES[kind], tuple(point)))


def random_size(rng) -> np.ndarray:
    """Sizes from small pads to long links and wide palms."""
    return np.exp(rng.uniform(np.log(4e-3), np.log(0.08), 3))


def surface_points(kind, count, rng, size=None) -> np.ndarray:
    """Points on the shape's surface, from its definition."""
    size = SIZES[kind] if size is None else size
    radius, half, _ = size
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
    return points * size


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
@given(seed=seeds)
def test_gradient_is_that_of_the_distance(kind, seed):
    point = np.random.default_rng(seed).uniform(-0.06, 0.06, 3)
    step, steps = 1e-7, 1e-7 * np.eye(3)
    slopes = (distance(kind, point + steps) - distance(kind, point - steps)) / (2 * step)
    found = gradient(kind, point)
    assert np.linalg.norm(found) == pytest.approx(1)
    if abs(np.linalg.norm(slopes) - 1) < 1e-6:  # elsewhere two faces are equally near
        np.testing.assert_allclose(found, slopes, atol=1e-5)


@KINDS
def test_most_random_points_lie_off_the_kinks(kind):
    points = np.random.default_rng(4).uniform(-0.06, 0.06, (300, 3))
    steps = 1e-7 * np.eye(3)
    slopes = [(distance(kind, point + steps) - distance(kind, point - steps)) / 2e-7 for point in points]
    assert np.mean(np.abs(np.linalg.norm(slopes, axis=1) - 1) < 1e-6) > 0.99
    assert {True, False} == {bool(d < 0) for d in distance(kind, points)}  # inside and outside


@KINDS
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.01), (0.0, 0.0, 0.2), (0.02, 0.0, 0.0)])
def test_gradient_on_axes_and_in_the_middle_is_a_unit_vector(kind, place):
    found = gradient(kind, place)
    assert np.linalg.norm(found) == pytest.approx(1)
    outwards = distance(kind, [np.add(place, 1e-6 * found)])[0] - distance(kind, [place])[0]
    assert outwards == pytest.approx(1e-6, rel=1e-6)


@KINDS
@given(seed=seeds)
def test_covering_spheres_enclose_the_shape(kind, seed):
    rng = np.random.default_rng(seed)
    size = random_size(rng)
    centers, radius, _ = covering_spheres(kind, size)
    corners = size * np.array(list(itertools.product((-1, 1), repeat=3))) if kind == BOX else np.empty((0, 3))
    points = np.vstack([surface_points(kind, 2_000, rng, size), corners])
    apart = np.linalg.norm(points[:, None] - centers, axis=2).min(axis=1)
    assert apart.max() <= radius * (1 + 1e-12)


@KINDS
@given(seed=seeds)
def test_points_inside_the_shape_are_covered_too(kind, seed):
    rng = np.random.default_rng(seed)
    size = random_size(rng)
    centers, radius, _ = covering_spheres(kind, size)
    points = surface_points(kind, 2_000, rng, size) * rng.random((2_000, 1))
    assert np.linalg.norm(points[:, None] - centers, axis=2).min(axis=1).max() <= radius


@KINDS
@given(seed=seeds)
def test_spheres_of_the_inside_radius_lie_inside_the_shape(kind, seed):
    size = random_size(np.random.default_rng(seed))
    centers, radius, insides = covering_spheres(kind, size)
    assert insides.shape == (len(centers),)
    assert (insides >= 0).all()  # none where the sphere's middle lies outside
    assert 0 < insides.max() <= radius
    within = insides > 0
    assert (distance(kind, centers[within], size) <= -insides[within] * (1 - 1e-12)).all()


@KINDS
def test_bounding_sphere_encloses_and_touches(kind):
    points = surface_points(kind, 5_000, np.random.default_rng(3))
    farthest = np.linalg.norm(points, axis=1).max()
    radius = bounding_radius(kind, SIZES[kind])
    assert farthest <= radius + 1e-15
    assert farthest >= 0.97 * radius


@KINDS
def test_covering_spheres_reach_not_far_beyond_a_link(kind):
    """A point of a sphere is at most its depth, radius plus distance of the centre, outside the shape."""
    size = {SPHERE: (0.01, 0, 0), CAPSULE: (0.0112, 0.035, 0), CYLINDER: (0.0445, 0.04, 0), BOX: (0.026, 0.0115, 0.006)}
    centers, radius, _ = covering_spheres(kind, np.array(size[kind]))
    assert (radius + distance(kind, centers, np.array(size[kind]))).max() < 0.04
    assert len(centers) < 40


@KINDS
def test_drawing_is_closed_and_lies_on_the_shape(kind):
    mesh = shape_mesh(kind, SIZES[kind])
    assert mesh.is_watertight
    assert np.abs(distance(kind, mesh.vertices)).max() < 1e-9
