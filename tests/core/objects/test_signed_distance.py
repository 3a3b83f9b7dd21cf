"""The distance grid: its bounds against exact distances, and which side of the surface it says a point is on."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.parametric import box
from fingersplit.objects.signed_distance import CELLS, build_distance_grid
from fingersplit.objects.signed_distance_kernel import MARGIN, SLACK, least_distance, rough_distance, sample_near
from fingersplit.objects.surface import sample_surface

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
    grid, (low, high) = model.distance, model.mesh.bounds
    end = np.array(grid.origin) + grid.cell * (np.array(grid.values.shape) - 1)
    np.testing.assert_allclose(low - grid.origin, MARGIN, atol=1e-12)
    assert (end - high >= MARGIN - 1e-12).all()
    assert (end - high < MARGIN + grid.cell + 1e-12).all()
    assert max(grid.values.shape) == CELLS + 1
    with pytest.raises(ValueError, match="read-only"):
        grid.values[0, 0, 0] = 0


@OBJECTS
def test_values_are_distances_to_the_surface(prepared, exact_mesh, name):
    """To the triangles near it, to the samples farther away, and now and then to the second nearest one."""
    model = prepared(name)
    picked, places = grid_points(model, 2_000)
    exact, values = exact_mesh(model.mesh).distance(places), np.abs(model.distance.values[tuple(picked.T)])
    excess = values - exact
    assert excess.min() > -1e-7
    assert excess.max() < (SLACK - HALF_DIAGONAL) * model.distance.cell
    near = exact < model.distance.cell
    assert near.sum() > 20
    assert np.mean(excess[near] > 0.1e-3) < 0.1


@OBJECTS
def test_samples_are_nearly_the_nearest_ones(prepared, name):
    model = prepared(name)
    picked, places = grid_points(model, 4_000)
    named = model.surface.grid.points[model.distance.samples[tuple(picked.T)]]
    excess = np.linalg.norm(places - named, axis=1) - cKDTree(model.surface.grid.points).query(places)[0]
    assert excess.max() < (SLACK - HALF_DIAGONAL) * model.distance.cell


@OBJECTS
def test_least_distance_never_exceeds_the_distance_to_the_samples(prepared, name):
    model = prepared(name)
    points = anywhere(model, 4_000, 1)
    exact = cKDTree(model.surface.grid.points).query(points)[0]
    assert (evaluate(least_distance, model, points) <= exact).all()


@OBJECTS
def test_least_distance_never_exceeds_that_to_the_triangles(prepared, exact_mesh, name):
    model = prepared(name)
    points = anywhere(model, 400, 6)
    assert (evaluate(least_distance, model, points) <= exact_mesh(model.mesh).distance(points) + 1e-12).all()


@OBJECTS
def test_least_distance_is_not_much_too_small_outside(prepared, name):
    """Outside the object and within the grid it is short by its slack and half a diagonal of a cell at most."""
    model = prepared(name)
    points = anywhere(model, 1_000, 2)[: 3 * 1_000]
    points = points[~model.mesh.trimesh.contains(points)]
    exact = cKDTree(model.surface.grid.points).query(points)[0]
    far = exact > 2 * model.distance.cell
    short = exact[far] - evaluate(least_distance, model, points[far])
    assert far.sum() > 500
    assert short.max() < (SLACK + HALF_DIAGONAL) * model.distance.cell + model.surface.spacing


@OBJECTS
def test_rough_distance_is_the_signed_distance_up_to_half_a_diagonal(prepared, exact_mesh, name):
    model = prepared(name)
    points = anywhere(model, 700, 3)[: 3 * 700]
    exact = exact_mesh(model.mesh).distance(points) * np.where(model.mesh.trimesh.contains(points), -1, 1)
    clear = np.abs(exact) > 2 * model.distance.cell  # nearer ones may change sides with the grid point
    error = evaluate(rough_distance, model, points)[clear] - exact[clear]
    assert clear.sum() > 500
    assert np.abs(error).max() < SLACK * model.distance.cell


@OBJECTS
def test_sign_tells_inside_from_outside(prepared, exact_mesh, name):
    model = prepared(name)
    picked, places = grid_points(model, 20_000)
    values = model.distance.values[tuple(picked.T)]
    near = np.abs(values) < 0.02
    picked, places, values = picked[near], places[near], values[near]
    clear = exact_mesh(model.mesh).distance(places) > 0.02 * model.distance.cell  # rays run that far beside the lattice
    inside = model.mesh.trimesh.contains(places)
    assert (inside & clear).sum() > 50
    assert (~inside & clear).sum() > 1_000
    np.testing.assert_array_equal(values[clear] < 0, inside[clear])


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
    assert excess.max() < (HALF_DIAGONAL + SLACK) * model.distance.cell


def test_inside_is_inside_also_below_a_hole(prepared):
    """Two triangles of twelve are missing from the top of a box: rays along the other axes still meet the surface."""
    whole = prepared("box").mesh
    top = (whole.vertices[whole.faces][:, :, 2] > 0.0599).all(axis=1)
    assert top.any()
    opened = Mesh(whole.vertices, whole.faces[~top])
    grid = build_distance_grid(opened, sample_surface(opened))
    for height in (-0.05, 0.0, 0.05):
        assert rough_distance(grid, (0.0, 0.0, height)) < -1e-3
    assert rough_distance(grid, (0.0, 0.0, 0.07)) > 0
    assert rough_distance(grid, (0.04, 0.0, 0.0)) > 0


def test_samples_can_be_those_of_another_surface(prepared):
    model = prepared("box")
    right = sample_surface(box((0.02, 0.02, 0.02)))
    grid = build_distance_grid(model.mesh, model.surface, right)
    np.testing.assert_array_equal(grid.values, model.distance.values)
    assert grid.samples.max() < len(right.normals)
    named = right.grid.points[sample_near(grid, (0.03, 0.0, 0.0))]
    np.testing.assert_allclose(named, [0.01, 0, 0], atol=1.5e-3)


def test_same_surface_gives_the_same_grid(prepared):
    model = prepared("mug")
    again = build_distance_grid(model.mesh, model.surface)
    np.testing.assert_array_equal(again.values, model.distance.values)
    np.testing.assert_array_equal(again.samples, model.distance.samples)
