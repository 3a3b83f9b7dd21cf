"""Drawn normals: smooth over a surface, sharp across its edges."""

from collections import defaultdict
from itertools import combinations

import numpy as np
import pytest
import trimesh

from fingersplit.recording.shading import CREASE, shaded_corners


def by_definition(vertices, faces):
    """Drawn normal of every corner, (m, 3, 3), the slow way."""
    areas = np.cross(*np.moveaxis(np.diff(vertices[faces], axis=1), 1, 0))
    units = areas / np.linalg.norm(areas, axis=1, keepdims=True)
    meeting = defaultdict(list)
    for f, face in enumerate(faces):
        for edge in combinations(sorted(face), 2):
            meeting[edge].append(f)
    patches = [{f} for f in range(len(faces))]
    for met in meeting.values():
        if len(met) == 2 and units[met[0]] @ units[met[1]] > np.cos(CREASE):
            joined = patches[met[0]] | patches[met[1]]
            for f in joined:
                patches[f] = joined
    normals = np.empty((len(faces), 3, 3))
    for f, face in enumerate(faces):
        for c, vertex in enumerate(face):
            total = sum(areas[g] for g in patches[f] if vertex in faces[g])
            normals[f, c] = total / np.linalg.norm(total)
    return normals


def rough_ball():
    ball = trimesh.creation.icosphere(subdivisions=2)
    return ball.vertices + np.random.default_rng(3).normal(scale=0.06, size=ball.vertices.shape), ball.faces


def three_faces_at_one_edge():
    return np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 1, 0.2]], float), np.array(
        [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    )


@pytest.mark.parametrize("make", [rough_ball, three_faces_at_one_edge])
def test_normals_are_those_of_the_definition(make):
    vertices, faces = make()
    corners, vertex_of, normals = shaded_corners(vertices, faces)
    np.testing.assert_array_equal(vertex_of[corners], faces)
    assert len(vertex_of) > len(vertices)  # some edges are creases
    np.testing.assert_allclose(normals[corners], by_definition(vertices, faces), atol=1e-12)


def test_only_creases_double_vertices():
    box, ball = trimesh.creation.box(), trimesh.creation.icosphere(subdivisions=3)
    corners, vertex_of, normals = shaded_corners(box.vertices, box.faces)
    assert len(vertex_of) == 24
    np.testing.assert_allclose(normals[corners], np.repeat(box.face_normals[:, None], 3, axis=1), atol=1e-12)
    _, vertex_of, normals = shaded_corners(ball.vertices, ball.faces)
    np.testing.assert_array_equal(vertex_of, np.arange(len(ball.vertices)))
    assert (normals * ball.vertices).sum(axis=1).min() > 0.999


def test_faces_without_area_have_no_normal_and_join_nothing():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], float)
    corners, vertex_of, normals = shaded_corners(vertices, np.array([[0, 1, 2], [0, 1, 3]]))
    np.testing.assert_array_equal(normals[corners[0]], np.tile((0.0, 0.0, 1.0), (3, 1)))
    np.testing.assert_array_equal(normals[corners[1]], np.zeros((3, 3)))
    assert len(vertex_of) == 6
