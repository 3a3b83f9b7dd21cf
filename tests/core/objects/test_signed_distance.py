"""The distance grid: its bounds against exact distances, and which side of the surface it says a point is on."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingersplit.objects.model import ObjectModel
from fingersplit.objects.signed_distance import (
    MARGIN,
    build_distance_grid,
    least_distance,
    rough_distance,
    sample_near,
)

OBJECTS = pytest.mark.parametrize("name", ["sphere", "box", "mug", "l_bracket"])
HALF_DIAGONAL = np.sqrt(3) / 2


def grid_points(model: ObjectModel, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices and places of some of the grid's points."""
    grid, rng = model.distance, np.random.default_rng(0)
    picked = rng.integers(grid.values.shape, size=(count, 3))
    return picked, np.array(grid.origin) + grid.cell * picked


def anywhere(model: ObjectModel, count: int, seed: int) -> np.ndarray:
    """Points near the surface, in the object's box, around it, and far away."""
    rng, samples = np.random.default_rng(seed), model.surface.grid.points
    low, high = samples.min(axis=0), samples.max(axis=0)
    close = samples[rng.integers(len(samples), size=count)] + rng.normal(scale=3e-3, size=(count, 3))
    boxes = [rng.uniform(low - reach, high + reach, (count, 3)) for reach in (0.0, MARGIN, 2 * MARGIN, 1.0)]
    return np.vstack([close, *boxes])


def evaluate(function, model: ObjectModel, points: np.ndarray) -> np.ndarray:
    return np.array([function(model.distance, tuple(point)) for point in points])


@OBJECTS
def test_grid_covers_the_object_and_its_surroundings(prepared, name):
    model = prepared(name)
    grid, samples = model.distance, model.surface.grid.points
    end = np.array(grid.origin) + grid.cell * (np.array(grid.values.shape) - 1)
    np.testing.assert_allclose(samples.min(axis=0) - grid.origin, MARGIN, atol=1e-12)
    assert (end - samples.max(axis=0) >= MARGIN - 1e-12).all()
    assert max(grid.values.shape) == 65
    with pytest.raises(ValueError, match="read-only"):
        grid.values[0, 0, 0] = 0


@OBJECTS
def test_values_are_distances_to_the_samples_they_name(prepared, name):
    model = prepared(name)
    picked, places = grid_points(model, 4_000)
    values = model.distance.values[tuple(picked.T)]
    named = model.surface.grid.points[model.distance.samples[tuple(picked.T)]]
    np.testing.assert_allclose(np.abs(values), np.linalg.norm(places - named, axis=1), atol=1e-7)
    excess = np.abs(values) - cKDTree(model.surface.grid.points).query(places)[0]
    assert excess.min() > -1e-7
    assert excess.max() < 0.1 * model.distance.cell
    assert np.mean(excess > 1e-6) < 0.05  # nearly always the nearest one


@OBJECTS
def test_least_distance_never_exceeds_the_distance_to_the_samples(prepared, name):
    model = prepared(name)
    points = anywhere(model, 4_000, 1)
    exact = cKDTree(model.surface.grid.points).query(points)[0]
    assert (evaluate(least_distance, model, points) <= exact).all()


@OBJECTS
def test_least_distance_is_not_much_too_small_outside(prepared, name):
    """Outside the object and within the grid it is short of the distance by two half diagonals of a cell at most."""
    model = prepared(name)
    points = anywhere(model, 1_000, 2)[: 3 * 1_000]
    points = points[~model.mesh.trimesh.contains(points)]
    exact = cKDTree(model.surface.grid.points).query(points)[0]
    far = exact > 2 * model.distance.cell
    short = exact[far] - evaluate(least_distance, model, points[far])
    assert far.sum() > 500
    assert short.max() < 2 * HALF_DIAGONAL * model.distance.cell * 1.02


@OBJECTS
def test_rough_distance_is_the_signed_distance_up_to_half_a_diagonal(prepared, exact_mesh, name):
    model = prepared(name)
    points = anywhere(model, 700, 3)[: 3 * 700]
    exact = exact_mesh(model.mesh).distance(points) * np.where(model.mesh.trimesh.contains(points), -1, 1)
    clear = np.abs(exact) > 2 * model.distance.cell  # nearer ones may change sides with the grid point
    error = evaluate(rough_distance, model, points)[clear] - exact[clear]
    assert clear.sum() > 500
    assert np.abs(error).max() < HALF_DIAGONAL * model.distance.cell + model.surface.spacing


@OBJECTS
def test_sign_tells_inside_from_outside(prepared, exact_mesh, name):
    model = prepared(name)
    picked, places = grid_points(model, 3_000)
    depth = exact_mesh(model.mesh).distance(places)
    clear = depth > 2 * model.surface.spacing
    inside = model.mesh.trimesh.contains(places)
    assert (inside & clear).sum() > 20
    np.testing.assert_array_equal(model.distance.values[tuple(picked.T)][clear] < 0, inside[clear])


def test_inside_of_a_mug_is_outside_of_the_object(prepared):
    model = prepared("mug")
    low, high = model.mesh.vertices.min(axis=0), model.mesh.vertices.max(axis=0)
    hollow = np.array([0.0, 0.0, 0.5 * (low + high)[2]])
    assert not model.mesh.trimesh.contains([hollow])[0]
    assert rough_distance(model.distance, tuple(hollow)) > 0.01


@OBJECTS
def test_far_away_the_distance_grows_with_the_way(prepared, name):
    model, direction = prepared(name), np.array([0.48, 0.6, 0.64])
    ways = np.linspace(0.2, 3.0, 40)
    exact = cKDTree(model.surface.grid.points).query(ways[:, None] * direction)[0]
    least = evaluate(least_distance, model, ways[:, None] * direction)
    assert (least <= exact).all()
    assert (np.diff(least) > 0).all()
    assert (least > MARGIN).all()


@OBJECTS
def test_sample_near_is_nearly_the_nearest(prepared, name):
    model = prepared(name)
    points = anywhere(model, 500, 4)[: 2 * 500]
    named = model.surface.grid.points[evaluate(sample_near, model, points)]
    excess = np.linalg.norm(points - named, axis=1) - cKDTree(model.surface.grid.points).query(points)[0]
    assert excess.max() < 2 * HALF_DIAGONAL * model.distance.cell * 1.02


def test_same_surface_gives_the_same_grid(prepared):
    model = prepared("mug")
    again = build_distance_grid(model.surface.grid, model.surface.normals)
    np.testing.assert_array_equal(again.values, model.distance.values)
    np.testing.assert_array_equal(again.samples, model.distance.samples)
