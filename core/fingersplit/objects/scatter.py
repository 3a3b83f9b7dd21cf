"""Random points spread over a triangle surface."""

import math

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.objects.mesh import Mesh
from fingersplit.vectors_kernel import add, cross, get, norm, put, scale, subtract

__all__ = ["scatter"]


def scatter(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points on a mesh in random order, one in each ``count``-th of its area.

    Returns:
        The points, (count, 3) [m], and the face that each lies on, (count,).
    """
    places = (rng.permutation(count) + rng.random(count)) * (mesh.area / count)
    points, faces = np.empty((count, 3)), np.empty(count, np.int64)
    order = np.argsort(places)
    _put_points(mesh.vertices, mesh.faces, places, order, rng.random((count, 2)), points, faces)
    return points, faces


@kernel
def _put_points(vertices, mesh_faces, places, order, turns, points, faces):
    """Put each point where the area of all faces before it, and a part of its face's, make up its place."""
    face, passed = -1, 0.0
    a, ab, ac = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in order:
        while passed <= places[i] and face < len(mesh_faces) - 1:
            face += 1
            a = get(vertices, mesh_faces[face, 0])
            ab = subtract(get(vertices, mesh_faces[face, 1]), a)
            ac = subtract(get(vertices, mesh_faces[face, 2]), a)
            passed += norm(cross(ab, ac)) / 2
        root = math.sqrt(turns[i, 0])
        along = add(scale(root * (1.0 - turns[i, 1]), ab), scale(root * turns[i, 1], ac))
        put(points, i, add(a, along))
        faces[i] = face
