"""Exact rays: against brute force over all triangles, along edges and walls of cells, and from anywhere."""

import math

import numpy as np
import pytest
import trimesh

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.triangle_grid import bin_triangles
from fingersplit.objects.triangle_grid_kernel import cast, face_normal


def grid_of(solid: trimesh.Trimesh):
    return bin_triangles(Mesh(solid.vertices, solid.faces))


def crossings(grid, origin, direction, longest=10.0, capacity=64):
    distances, faces = np.empty(capacity), np.empty(capacity, np.int64)
    found = cast(grid, tuple(map(float, origin)), tuple(map(float, direction)), longest, distances, faces)
    return distances[:found], faces[:found]


def brute_force(mesh, origin, direction) -> np.ndarray:
    """Distances of all crossings, by solving for the barycentric coordinates in every triangle."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    system = np.stack([b - a, c - a, np.broadcast_to(-direction, a.shape)], axis=2)
    facing = np.abs(np.linalg.det(system)) > 1e-18
    u, v, t = np.linalg.solve(system[facing], (origin - a[facing])[..., None])[..., 0].T
    return np.sort(t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)])


def random_rays(count, size, seed=0):
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return rng.uniform(-size, size, (count, 3)), directions


@pytest.mark.parametrize("name", ["box", "cylinder", "mug", "l_bracket"])
def test_every_crossing_is_found_once(prepared, name):
    model = prepared(name)
    for origin, direction in zip(*random_rays(150, 0.06), strict=True):
        distances, faces = crossings(model.triangles, origin, direction)
        np.testing.assert_allclose(distances, brute_force(model.mesh, origin, direction), atol=1e-12)
        points = origin + distances[:, None] * direction
        corners = model.mesh.vertices[model.mesh.faces[faces, 0]]
        normals = model.mesh.trimesh.face_normals[faces]
        np.testing.assert_allclose(np.einsum("ij,ij->i", points - corners, normals), 0, atol=1e-12)


def test_real_meshes_agree_with_embree(every_object):
    lows, highs = every_object.mesh.bounds
    rng = np.random.default_rng(1)
    inside = rng.uniform(lows, highs, (300, 3))
    _, directions = random_rays(300, 1.0, seed=2)
    origins = inside - directions
    distances, faces = np.full(len(origins), math.inf), np.full(len(origins), -1)
    for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        cast(every_object.triangles, tuple(origin), tuple(direction), 3.0, distances[i : i + 1], faces[i : i + 1])
    hits, rays, points = every_object.mesh.trimesh.ray.intersects_id(
        origins, directions, multiple_hits=False, return_locations=True
    )[:3]
    expected = np.full(len(origins), math.inf)
    expected[rays] = np.linalg.norm(points - origins[rays], axis=1)
    differ = ~np.isclose(distances, expected, atol=2e-6, rtol=0)  # embree works in single precision
    assert differ.mean() < 0.02  # at silhouettes and slits it slips through edges
    assert (faces[np.isfinite(distances)] >= 0).all()
    assert (faces[~np.isfinite(distances)] == -1).all()
    assert len(hits)


def test_no_ray_slips_between_neighbours():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.03)
    grid = grid_of(ball)
    edges = ball.vertices[ball.edges_unique]
    shares = np.random.default_rng(0).uniform(size=(len(edges), 1))
    for target in np.concatenate([ball.vertices, shares * edges[:, 0] + (1 - shares) * edges[:, 1]]):
        direction = target / np.linalg.norm(target)
        distances, _ = crossings(grid, (0.0, 0.0, 0.0), direction)
        assert len(distances)
        assert distances == pytest.approx(np.linalg.norm(target), abs=1e-12)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rays_along_the_axes_meet_walls_flush_with_the_grid(axis, sign):
    block = trimesh.creation.box((0.04, 0.06, 0.08)).subdivide().subdivide()
    grid = grid_of(block)
    direction = sign * np.eye(3)[axis]
    for offset in np.random.default_rng(3).uniform(-0.02, 0.02, (50, 3)):
        origin = np.where(np.arange(3) == axis, -0.5 * direction, offset)
        distances, faces = crossings(grid, origin, direction)
        half = (0.02, 0.03, 0.04)[axis]
        assert sorted(set(np.round(distances, 12))) == pytest.approx([0.5 - half, 0.5 + half])
        assert np.dot(face_normal(grid, faces[0]), direction) == pytest.approx(-1.0)
        assert np.dot(face_normal(grid, faces[-1]), direction) == pytest.approx(1.0)


def test_capacity_keeps_the_nearest_and_length_ends_the_ray(prepared):
    model = prepared("mug")
    for origin, direction in zip(*random_rays(60, 0.05, seed=5), strict=True):
        everything, _ = crossings(model.triangles, origin, direction)
        for capacity in (1, 2):
            few, _ = crossings(model.triangles, origin, direction, capacity=capacity)
            np.testing.assert_array_equal(few, everything[:capacity])
        short, _ = crossings(model.triangles, origin, direction, longest=0.03)
        np.testing.assert_array_equal(short, everything[everything <= 0.03])


def test_rays_that_miss_the_grid_find_nothing(prepared):
    model = prepared("box")
    for origin, direction in (((1.0, 0, 0), (1.0, 0, 0)), ((1.0, 0, 0), (0, 1.0, 0)), ((0, 0, 1.0), (0, 0.6, 0.8))):
        assert len(crossings(model.triangles, origin, direction)[0]) == 0


def test_flat_and_needle_shapes_are_binned():
    for sides in ((0.1, 0.1, 1e-4), (0.2, 1e-3, 1e-3)):
        block = trimesh.creation.box(sides)
        grid = grid_of(block)
        assert np.prod(grid.shape) <= 256**3
        distances, _ = crossings(grid, (0.013, 0.0002, -1.0), (0.0, 0.0, 1.0))
        assert distances == pytest.approx([1.0 - sides[2] / 2, 1.0 + sides[2] / 2])


def test_arrays_are_read_only(prepared):
    grid = prepared("box").triangles
    for array in (grid.starts, grid.members, grid.vertices, grid.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
