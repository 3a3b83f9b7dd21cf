"""Kernel of `cleaning`: the parts that a watertight surface hangs together in."""

import numpy as np

from fingersplit.compilation import kernel

__all__ = ["parts_by_edges"]


@kernel
def parts_by_edges(faces, n_vertices):
    """Number of the part of each face, (m,) int64: faces on the two sides of an edge belong to the same one.

    Args:
        faces: Vertex indices, (m, 3); the side of each is met by exactly one other, which runs the other way.
        n_vertices: All indices are below.
    """
    first = np.zeros(n_vertices + 1, np.int64)  # of the sides that leave each vertex
    for face in range(len(faces)):
        for k in range(3):
            first[faces[face, k] + 1] += 1
    for vertex in range(n_vertices):
        first[vertex + 1] += first[vertex]
    sides, filled = np.empty(3 * len(faces), np.int64), first.copy()
    for face in range(len(faces)):
        for k in range(3):
            vertex = faces[face, k]
            sides[filled[vertex]] = 3 * face + k
            filled[vertex] += 1
    parts, waiting, n_parts = np.full(len(faces), -1), np.empty(len(faces), np.int64), 0
    for seed in range(len(faces)):
        if parts[seed] >= 0:
            continue
        parts[seed] = n_parts
        waiting[0], left = seed, 1
        while left:
            left -= 1
            face = waiting[left]
            for k in range(3):
                start, end = faces[face, k], faces[face, (k + 1) % 3]
                for place in range(first[end], first[end + 1]):
                    other, corner = sides[place] // 3, sides[place] % 3
                    if parts[other] < 0 and faces[other, (corner + 1) % 3] == start:
                        parts[other] = n_parts
                        waiting[left] = other
                        left += 1
        n_parts += 1
    return parts
