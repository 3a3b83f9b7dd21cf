"""Convex pieces: convex, close to the surface, the same every time, and whole through a cache."""

import numpy as np
import pytest
import trimesh

from fingersplit.objects.convex_pieces import (
    CONVEX_DEPTH,
    HULL_VERTICES,
    PIECE_VERTICES,
    ConvexPieces,
    decompose,
)
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS


@pytest.mark.parametrize("name", ["l_bracket", "mug"])
def test_pieces_are_convex_small_and_near_the_surface(name):
    mesh = PARAMETRIC_OBJECTS[name]()
    pieces = decompose(mesh, 32, 5_000)
    assert pieces.method == "vhacdx"
    assert 1 < len(pieces.pieces) <= 32
    for vertices, faces in pieces.pieces:
        assert len(vertices) <= PIECE_VERTICES
        body = trimesh.Trimesh(vertices, faces)
        assert body.is_convex
        assert body.volume > 0
    points, _ = trimesh.sample.sample_surface(mesh.trimesh, 2000, seed=0)
    assert np.abs(pieces.distance(points)).mean() < 1.5e-3


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "capsule", "cylinder", "wedge"])
def test_convex_object_is_one_hull_near_its_surface(name):
    mesh = PARAMETRIC_OBJECTS[name]()
    pieces = decompose(mesh)
    assert (pieces.method, len(pieces.pieces)) == ("convex_hull", 1)
    assert len(pieces.pieces[0][0]) <= HULL_VERTICES
    points, _ = trimesh.sample.sample_surface(mesh.trimesh, 2000, seed=0)
    assert np.abs(pieces.distance(points)).max() < CONVEX_DEPTH
    assert np.abs(pieces.distance(points)).mean() < 0.1e-3


def test_small_dent_is_not_closed_by_the_hull():
    """A dent of 3 mm in a sphere is a thousandth of its volume, but a fingertip could lie in it."""
    sphere = PARAMETRIC_OBJECTS["sphere"]()
    vertices = sphere.vertices.copy()
    tip = vertices[:, 2] > 0.995 * vertices[:, 2].max()
    vertices[tip, 2] -= 0.003
    dented = Mesh(vertices, sphere.faces)
    hull = trimesh.convex.convex_hull(vertices)
    assert hull.volume - dented.volume < 0.002 * hull.volume
    assert decompose(dented, 32, 5_000).method == "vhacdx"


def test_distance_is_that_of_the_solids():
    box = decompose(PARAMETRIC_OBJECTS["box"]())
    assert box.method == "convex_hull"
    x = PARAMETRIC_OBJECTS["box"]().bounds[1, 0]
    middle = PARAMETRIC_OBJECTS["box"]().bounds.mean(axis=0)
    queries = np.array([middle, (x, middle[1], middle[2]), (x + 0.01, middle[1], middle[2])])
    half = (PARAMETRIC_OBJECTS["box"]().extents / 2).min()
    np.testing.assert_allclose(box.distance(queries), [-half, 0.0, 0.01], atol=1e-9)


def test_same_mesh_same_pieces_and_arrays_bring_them_back():
    mesh = PARAMETRIC_OBJECTS["l_bracket"]()
    first, second = decompose(mesh, 16, 5_000), decompose(mesh, 16, 5_000)
    restored = ConvexPieces.from_arrays(first.to_arrays())
    assert first.method == restored.method
    for pieces in (second, restored):
        for one, other in zip(first.pieces, pieces.pieces, strict=True):
            np.testing.assert_array_equal(one[0], other[0])
            np.testing.assert_array_equal(one[1], other[1])
