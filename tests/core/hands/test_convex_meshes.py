"""Meshes of links as convex pieces, found once and kept."""

import numpy as np
import pytest
import trimesh

from fingersplit.cache import ContentCache
from fingersplit.hands import convex_meshes
from fingersplit.hands.convex_meshes import convex_pieces


@pytest.fixture
def bracket():
    """Two bars that meet at a right angle, 60 mm long."""
    corner = [[0, 0], [0.06, 0], [0.06, 0.01], [0.01, 0.01], [0.01, 0.06], [0, 0.06]]
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    mesh = trimesh.creation.extrude_triangulation(np.array(corner), np.array(faces), 0.01)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


@pytest.fixture
def kept(tmp_path, monkeypatch):
    monkeypatch.setattr(convex_meshes, "_kept", lambda: ContentCache(tmp_path, 2**20))
    return tmp_path


def refuse(*_):
    raise AssertionError("decomposed again")


def test_pieces_fill_the_mesh_and_not_its_hull(bracket, kept):
    pieces = convex_pieces(*bracket)
    assert len(pieces) > 1
    volumes = [trimesh.Trimesh(*piece).volume for piece in pieces]
    assert min(volumes) > 0
    assert sum(volumes) == pytest.approx(0.01 * (0.06 * 0.01 + 0.05 * 0.01), rel=0.15)


def test_pieces_found_once_are_read_again(bracket, kept, monkeypatch):
    first = convex_pieces(*bracket)
    monkeypatch.setattr(convex_meshes, "_run", refuse)
    for found, again in zip(first, convex_pieces(*bracket), strict=True):
        np.testing.assert_array_equal(found[0], again[0])
        np.testing.assert_array_equal(found[1], again[1])


def test_another_mesh_has_pieces_of_its_own(bracket, kept, monkeypatch):
    convex_pieces(*bracket)
    monkeypatch.setattr(convex_meshes, "_run", refuse)
    with pytest.raises(AssertionError, match="decomposed again"):
        convex_pieces(bracket[0] * 1.001, bracket[1])


def test_damaged_pieces_are_found_anew(bracket, kept):
    first = convex_pieces(*bracket)
    (entry,) = kept.glob("*.arrays")
    entry.write_bytes(entry.read_bytes()[:-20])
    np.testing.assert_array_equal(convex_pieces(*bracket)[0][0], first[0][0])


def test_a_convex_mesh_is_its_hull(kept):
    box = trimesh.creation.box((0.02, 0.03, 0.04))
    ((corners, faces),) = convex_pieces(np.asarray(box.vertices), np.asarray(box.faces))
    assert trimesh.Trimesh(corners, faces).volume == pytest.approx(0.02 * 0.03 * 0.04)
    assert not list(kept.glob("*.arrays"))
