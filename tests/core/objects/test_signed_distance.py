"""The distance grid against exact distances and inside tests; open meshes; gradients by finite differences."""

import numpy as np
import pytest

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS, box
from fingersplit.objects.signed_distance import MARGIN, build_distance_grid, count_enclosures, least_distance
from fingersplit.objects.signed_distance import signed_distance as look_up
from fingersplit.objects.surface import sample_surface

OBJECTS = pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))
RADIUS = 0.035  # of the parametric sphere


def some_nodes(grid, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and values of some grid points."""
    index = np.stack([np.random.default_rng(0).integers(size, size=count) for size in grid.values.shape], axis=1)
    return np.array(grid.origin) + grid.cell * index, grid.values[tuple(index.T)]


@OBJECTS
def test_grid_reaches_around_the_object(prepared, name):
    model = prepared(name)
    grid = model.distance
    high = np.array(grid.origin) + grid.cell * (np.array(grid.values.shape) - 1)
    assert (model.mesh.bounds[0] - grid.origin >= MARGIN - 1e-9).all()
    assert (high - model.mesh.bounds[1] >= MARGIN - 1e-9).all()
    assert max(grid.values.shape) <= 98
    assert not grid.values.flags.writeable


@OBJECTS
def test_sign_tells_inside_from_outside(prepared, name):
    model = prepared(name)
    places, values = some_nodes(model.distance, 4_000)
    inside = model.mesh.trimesh.contains(places)
    assert inside.any()
    clear = np.abs(values) > 0.1e-3  # on the surface itself either may be said
    assert np.count_nonzero((values < 0)[clear] != inside[clear]) <= 2


@OBJECTS
def test_values_are_distances_to_a_part_of_a_millimetre(prepared, exact_mesh, name):
    model = prepared(name)
    places, values = some_nodes(model.distance, 400)
    error = np.abs(np.abs(values) - exact_mesh(model.mesh).distance(places))
    assert np.percentile(error, 95) < 0.5e-3
    assert error.max() < model.surface.spacing


def test_distance_between_grid_points_is_that_of_a_sphere(prepared):
    grid = prepared("sphere").distance
    directions = np.random.default_rng(0).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for height in (-15e-3, -3e-3, 0.0, 4e-3, 30e-3):
        for direction in directions:
            value, gradient = look_up(grid, tuple((RADIUS + height) * direction))
            assert value == pytest.approx(height, abs=0.4e-3)
            assert np.dot(gradient, direction) == pytest.approx(1, abs=0.15)


def test_gradient_is_the_finite_difference(prepared):
    grid, step = prepared("mug").distance, 1e-7
    for point in np.random.default_rng(0).uniform(-0.06, 0.06, (200, 3)):
        cells = (point - grid.origin) / grid.cell
        if np.abs(cells - np.rint(cells)).min() < 0.01:  # at a cell's side the gradient jumps
            continue
        _, gradient = look_up(grid, tuple(point))
        for axis in range(3):
            aside = step * np.eye(3)[axis]
            rise = look_up(grid, tuple(point + aside))[0] - look_up(grid, tuple(point - aside))[0]
            assert gradient[axis] == pytest.approx(rise / (2 * step), abs=1e-5)


@OBJECTS
def test_least_distance_never_promises_too_much(prepared, exact_mesh, name):
    model = prepared(name)
    points = np.random.default_rng(1).uniform(-0.25, 0.25, (300, 3))
    exact = exact_mesh(model.mesh).distance(points)
    exact = np.where(model.mesh.trimesh.contains(points), -exact, exact)
    least = np.array([least_distance(model.distance, tuple(point)) for point in points])
    assert (least <= exact + model.surface.spacing).all()


def test_lookup_outside_takes_the_border(prepared):
    grid = prepared("box").distance
    far = look_up(grid, (10.0, 0.0, 0.0))[0]
    assert far == pytest.approx(MARGIN, rel=0.1)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25])
def test_sign_of_an_open_surface_is_that_of_the_closed_one(prepared, share):
    """Up to a quarter of a ball is missing; away from the hole, inside stays inside."""
    closed = prepared("sphere")
    top = closed.mesh.vertices[closed.mesh.faces].mean(axis=1)[:, 2] > RADIUS * (1 - 2 * share)
    opened = Mesh(closed.mesh.vertices, closed.mesh.faces[~top])
    grid = build_distance_grid(opened, sample_surface(opened))
    places, values = some_nodes(grid, 20_000)
    radii = np.linalg.norm(places, axis=1)
    away = places[:, 2] < RADIUS * (1 - 2 * share) - 8e-3
    assert (values[away & (radii < RADIUS - 1e-3)] < 0).all()
    assert (values[radii > RADIUS + 1e-3] > 0).all()


def test_closed_mesh_on_the_lattice_gets_all_votes():
    """Rays along the lattice of a box meet its edges and corners; six votes or none all the same."""
    mesh = box((0.04, 0.06, 0.1))
    votes = np.zeros((30, 30, 30), np.int8)
    low, cell = np.array([-0.05, -0.05, -0.06]), 0.005
    for axis in range(3):
        count_enclosures(mesh.vertices[mesh.faces], axis, low, cell, votes)
    places = low + cell * np.stack(np.meshgrid(*[np.arange(30)] * 3, indexing="ij"), axis=-1)
    beyond = (np.abs(places) - mesh.extents / 2).max(axis=-1)
    assert (votes[beyond < -1e-6] == 6).all()
    assert (votes[beyond > 1e-6] == 0).all()
