"""Patches: all of the surface is in them, and they reach no farther than they need to."""

import numpy as np
import pytest
import trimesh

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.patches import build_patches
from fingersplit.objects.patches_kernel import halve_triangle
from fingersplit.objects.scatter import scatter
from fingersplit.objects.surface import sample_surface


def check_cover(patches, mesh: Mesh) -> None:
    points, faces = scatter(mesh, 3_000, np.random.default_rng(8))
    owners = np.repeat(np.arange(len(patches.reaches)), np.diff(patches.starts))
    order = np.argsort(patches.members, kind="stable")
    first = np.searchsorted(patches.members[order], np.arange(len(mesh.faces) + 1))
    for point, face in zip(points, faces, strict=True):
        samples = owners[order[first[face] : first[face + 1]]]
        offsets = point - patches.grid.points[samples]
        within = np.linalg.norm(offsets, axis=1) <= patches.reaches[samples] + 1e-9
        rises = np.abs((offsets * patches.normals[samples]).sum(axis=1))
        assert (within & (rises <= patches.plane_deviations[samples] + 1e-9)).any()


@pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))
def test_every_point_of_every_triangle_is_in_a_patch_of_its(prepared, name):
    model = prepared(name)
    check_cover(model.patches, model.mesh)
    assert model.patches.longest_reach == model.patches.reaches.max()
    assert model.patches.longest_reach < 3 * model.surface.spacing
    assert len(model.patches.members) < 4 * len(model.patches.reaches) + len(model.mesh.faces)


def test_triangles_too_small_to_carry_a_sample_are_in_patches():
    solid = trimesh.creation.icosphere(subdivisions=6, radius=0.02)
    mesh = Mesh(solid.vertices, solid.faces)
    surface = sample_surface(mesh)
    assert len(mesh.faces) > 3 * len(surface.normals)
    patches = build_patches(mesh, surface)
    np.testing.assert_array_equal(np.unique(patches.members), np.arange(len(mesh.faces)))
    check_cover(patches, mesh)


def test_a_patch_names_no_triangle_twice(prepared):
    patches = prepared("box").patches
    for first, last in zip(patches.starts[:-1], patches.starts[1:], strict=True):
        assert len(np.unique(patches.members[first:last])) == last - first


def test_triangles_are_halved_across_their_longest_side():
    corners = np.array([[0.0, 0, 0], [3.0, 0, 0], [0.0, 1, 0]])
    for turn in range(3):
        stack = np.zeros((3, 3, 3))
        stack[1] = np.roll(corners, turn, axis=0)
        assert not halve_triangle(stack, 1, 4.0)
        assert halve_triangle(stack, 1, 3.0)
        areas = [np.linalg.norm(np.cross(t[1] - t[0], t[2] - t[0])) / 2 for t in stack[1:]]
        np.testing.assert_allclose(areas, [0.75, 0.75])
        assert any((corner == (1.5, 0.5, 0)).all() for corner in stack[1])
        assert not halve_triangle(stack, 2, 0.0)  # the stack has no room left
