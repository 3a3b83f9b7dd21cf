"""Kernel of `scatter`: points by area."""

import math

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, cross, get, norm, put, scale, subtract

__all__ = ["put_points"]


@kernel
def put_points(vertices, mesh_faces, places, order, turns, points, faces):
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
