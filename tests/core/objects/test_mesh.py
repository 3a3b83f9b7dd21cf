"""The checked mesh: measures of known solids, identity by content, no way to change it."""

import dataclasses

import numpy as np
import pytest

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS, box, mug, sphere


def test_measures_of_a_box():
    mesh = box((0.04, 0.06, 0.1))
    np.testing.assert_allclose(mesh.extents, [0.04, 0.06, 0.1])
    np.testing.assert_allclose(mesh.bounds, [[-0.02, -0.03, -0.05], [0.02, 0.03, 0.05]])
    assert mesh.area == pytest.approx(2 * (0.04 * 0.06 + 0.06 * 0.1 + 0.04 * 0.1))
    assert mesh.volume == pytest.approx(0.04 * 0.06 * 0.1)
    np.testing.assert_allclose(mesh.center_of_mass, 0, atol=1e-12)


@pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))
def test_volume_and_centre_are_those_of_trimesh_wherever_the_mesh_stands(name):
    made, shift = PARAMETRIC_OBJECTS[name](), np.array([0.3, -0.2, 0.5])
    mesh = Mesh(made.vertices + shift, made.faces)
    assert mesh.volume == pytest.approx(made.trimesh.volume, rel=1e-9)
    np.testing.assert_allclose(mesh.center_of_mass, made.trimesh.center_mass + shift, atol=1e-9)


def test_open_surface_has_the_volume_of_its_hull():
    closed = box((0.04, 0.06, 0.1))
    lid = (closed.vertices[closed.faces][:, :, 2] > 0.0499).all(axis=1)
    opened = Mesh(closed.vertices, closed.faces[~lid])
    assert opened.volume == pytest.approx(closed.volume)
    np.testing.assert_allclose(opened.center_of_mass, 0, atol=1e-9)


def test_content_hash_tells_meshes_apart():
    mesh = sphere()
    assert len(mesh.content_hash) == 32
    assert int(mesh.content_hash, 16) >= 0
    assert Mesh(mesh.vertices.copy(), mesh.faces.astype(np.int64)).content_hash == mesh.content_hash
    moved = mesh.vertices.copy()
    moved[0, 0] += 1e-15
    others = [Mesh(moved, mesh.faces), Mesh(mesh.vertices, mesh.faces[::-1]), mug()]
    assert len({mesh.content_hash, *(other.content_hash for other in others)}) == 4


def test_mesh_cannot_be_changed_and_shares_nothing_with_its_source():
    source = np.array(sphere().vertices)
    mesh = Mesh(source, sphere().faces)
    source[0] = 1.0
    assert mesh.vertices[0, 0] != 1.0
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        mesh.vertices = source
