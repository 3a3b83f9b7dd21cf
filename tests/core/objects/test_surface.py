"""Surface samples, their normals, and the nearest point against the exact triangles."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS, box
from fingersplit.objects.surface import sample_surface
from fingersplit.objects.surface_kernel import MAX_OVERHANG, closest, distance_to_triangle, touch

RADIUS = 0.035  # of the parametric sphere

OBJECTS = pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))


@OBJECTS
def test_samples_lie_on_the_mesh_apart_from_each_other_and_cover_it(prepared, exact_mesh, name):
    model = prepared(name)
    surface, points = model.surface, model.surface.grid.points
    assert 15_000 < len(points) < 35_000
    picked = np.random.default_rng(0).integers(len(points), size=300)
    assert exact_mesh(model.mesh).distance(points[picked]).max() < 1e-9
    tree = cKDTree(points)
    assert tree.query(points, k=2)[0][:, 1].min() >= surface.spacing
    anywhere, _ = trimesh.sample.sample_surface(model.mesh.trimesh, 20_000, seed=np.random.default_rng(1))
    gaps, _ = tree.query(anywhere)
    assert np.percentile(gaps, 99) < 1.15 * surface.spacing
    assert gaps.max() < 1.7 * surface.spacing


@OBJECTS
def test_triangles_are_those_of_the_samples(prepared, name):
    surface = prepared(name).surface
    first, second, third = surface.triangles.transpose(1, 0, 2)
    whole = np.linalg.norm(np.cross(second - first, third - first), axis=1)
    points = surface.grid.points
    parts = [np.cross(a - points, b - points) for a, b in ((first, second), (second, third), (third, first))]
    np.testing.assert_allclose(np.linalg.norm(parts, axis=2).sum(axis=0), whole, rtol=1e-9)


def test_same_mesh_gives_the_same_samples(prepared):
    model = prepared("mug")
    again = sample_surface(Mesh(model.mesh.vertices, model.mesh.faces))
    np.testing.assert_array_equal(again.grid.points, model.surface.grid.points)
    np.testing.assert_array_equal(again.normals, model.surface.normals)


def test_samples_do_not_follow_the_triangulation():
    coarse = trimesh.creation.box(extents=(0.05, 0.07, 0.12))
    few = sample_surface(Mesh(coarse.vertices, coarse.faces))
    many = sample_surface(box((0.05, 0.07, 0.12)))
    assert len(few.normals) == pytest.approx(len(many.normals), rel=0.02)
    assert few.spacing == pytest.approx(many.spacing)


def test_small_objects_get_fewer_samples_rather_than_closer_ones():
    surface = sample_surface(box((0.01, 0.01, 0.01)))
    assert surface.spacing == 0.4e-3
    assert len(surface.normals) < 4_000


@OBJECTS
def test_normals_are_unit_and_point_out(prepared, name):
    model = prepared(name)
    normals, points = model.surface.normals, model.surface.grid.points
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    picked = np.random.default_rng(0).integers(len(points), size=2000)
    step = 0.2e-3 * normals[picked]
    assert not model.mesh.trimesh.contains(points[picked] + step).any()
    assert model.mesh.trimesh.contains(points[picked] - step).mean() > 0.995  # the rest grazes an edge


def test_edges_of_a_box_stay_sharp(prepared):
    normals = prepared("box").surface.normals
    np.testing.assert_allclose(np.abs(normals).max(axis=1), 1, atol=1e-9)


def test_normals_of_a_sphere_are_radial(prepared):
    surface = prepared("sphere").surface
    radial = surface.grid.points / np.linalg.norm(surface.grid.points, axis=1, keepdims=True)
    angles = np.arccos(np.clip((surface.normals * radial).sum(axis=1), -1, 1))
    assert angles.max() < np.radians(2.5)
    assert angles.mean() < np.radians(1)


@pytest.mark.parametrize("offset", [-5e-3, 0.0, 7e-3, 0.1])
def test_closest_point_of_a_sphere_is_the_radial_one(prepared, offset):
    surface = prepared("sphere").surface
    directions = np.random.default_rng(0).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = [closest(surface, tuple((RADIUS + offset) * u), -1) for u in directions]
    points, normals = np.array([point for _, point, _ in found]), np.array([normal for _, _, normal in found])
    off_surface = np.abs(np.linalg.norm(points, axis=1) - RADIUS)
    assert off_surface.max() < 0.1e-3
    aside = np.linalg.norm(points - RADIUS * directions, axis=1)
    assert np.percentile(aside, 99) < max(1, offset / RADIUS) * surface_tilt(surface) * (RADIUS + offset)
    assert np.arccos(np.clip((normals * directions).sum(axis=1), -1, 1)).max() < np.radians(4)


def surface_tilt(surface) -> float:
    """What a sample's tangent plane may be turned by: its own distance and the facet's tilt [rad]."""
    return surface.spacing / RADIUS + np.radians(2.5)


@pytest.mark.parametrize("name", ["l_bracket", "mug"])
def test_closest_point_is_on_the_tangent_plane_or_beside_a_crease_on_the_triangle(prepared, exact_mesh, name):
    model, rng = prepared(name), np.random.default_rng(0)
    surface, exact = model.surface, exact_mesh(model.mesh)
    creased = 0
    for query in rng.uniform(-0.1, 0.1, (300, 3)):
        i, point, normal = closest(surface, tuple(query), -1)
        np.testing.assert_array_equal(normal, surface.normals[i])
        if surface.creased[i]:
            creased += 1
            assert exact.distance([point])[0] < 1e-9
            own_distance = distance_to_triangle(surface.triangles[i], tuple(query))
            assert np.linalg.norm(query - point) == pytest.approx(own_distance, abs=1e-12)
        else:
            sample = surface.grid.points[i]
            assert np.linalg.norm(point - sample) <= surface.spacing * (1 + 1e-9)
            assert abs(np.dot(np.subtract(point, sample), surface.normals[i])) < 1e-12
    assert 10 < creased < 290


def test_creases_are_beside_the_edges_of_a_box(prepared):
    surface = prepared("box").surface
    half = np.array([0.025, 0.035, 0.06])
    from_edge = np.sort(half - np.abs(surface.grid.points), axis=1)[:, 1]
    nearest_uncreased = from_edge[~surface.creased].min()
    assert nearest_uncreased == pytest.approx(surface.spacing - MAX_OVERHANG, abs=0.01e-3)
    assert from_edge[surface.creased].max() < surface.spacing - MAX_OVERHANG


def test_neither_a_ball_nor_a_thin_plate_has_creases_on_its_faces(prepared):
    assert not prepared("sphere").surface.creased.any()
    surface = sample_surface(box((0.1, 0.1, 0.5e-3)))
    assert not surface.creased[(np.abs(surface.grid.points[:, :2]) < 0.05 - surface.spacing).all(axis=1)].any()


@OBJECTS
def test_touch_is_the_distance_to_the_triangles(prepared, exact_mesh, name):
    model, rng = prepared(name), np.random.default_rng(0)
    surface = model.surface
    picked = rng.integers(len(surface.normals), size=300)
    height = rng.uniform(1e-3, 15e-3, (300, 1))
    aside = rng.normal(scale=2e-3, size=(300, 3))
    queries = surface.grid.points[picked] + height * surface.normals[picked] + aside
    exact = exact_mesh(model.mesh).distance(queries)
    found = [touch(surface, tuple(query), -1) for query in queries]
    distances, points = np.array([d for d, _ in found]), np.array([p for _, p in found])
    np.testing.assert_allclose(np.linalg.norm(queries - points, axis=1), distances, atol=1e-12)
    error = distances - exact
    assert error.min() > -1e-12  # never closer than the mesh
    assert np.percentile(error, 99) < 0.3e-3
    assert (error < surface.spacing**2 / (2 * exact)).all()
    assert exact_mesh(model.mesh).distance(points).max() < 1e-9
