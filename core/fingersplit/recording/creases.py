"""Normals for drawing: smooth over a surface, except across its creases."""

import math

import numpy as np
from numpy.typing import NDArray

from fingersplit.recording.creases_kernel import corners_of_vertices, smooth_patches, split_vertices

__all__ = ["CREASE", "shaded_corners"]

CREASE = 0.6
"""Faces that meet at a larger angle keep a sharp edge between them [rad]."""


def shaded_corners(
    vertices: NDArray[np.floating], faces: NDArray[np.integer]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Vertices as they are drawn: one for every patch of faces that meets smoothly at a vertex.

    Args:
        vertices: Corner points, (n, 3) [m].
        faces: Vertex indices, counter-clockwise seen from outside, (m, 3).

    Returns:
        The faces by drawn vertices (m, 3), the vertex that each of those stands for (k,), in ascending order, and its
        unit outward normal (k, 3): the mean of its patch's faces by area, zero where they have none.
    """
    vertices, faces = np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int64)
    starts, corners = corners_of_vertices(faces, len(vertices))
    areas, units = np.empty(faces.shape), np.empty(faces.shape)
    patches = smooth_patches(vertices, faces, starts, corners, math.cos(CREASE), areas, units)
    drawn, vertex_of, normals = split_vertices(faces, starts, corners, patches, areas)
    return drawn, vertex_of, normals
