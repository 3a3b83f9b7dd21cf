"""The kernels behind ``shaded_corners``."""

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, cross, dot, get, norm, put, scale, subtract

__all__ = ["corners_of_vertices", "smooth_patches", "split_vertices"]


@kernel
def corners_of_vertices(faces, count):
    """The corners (3 face + place) of every vertex, those of vertex v from ``starts[v]`` on."""
    starts = np.zeros(count + 1, np.int64)
    for f in range(len(faces)):
        for c in range(3):
            starts[faces[f, c] + 1] += 1
    for v in range(count):
        starts[v + 1] += starts[v]
    filled, corners = starts[:-1].copy(), np.empty(3 * len(faces), np.int64)
    for f in range(len(faces)):
        for c in range(3):
            corners[filled[faces[f, c]]] = 3 * f + c
            filled[faces[f, c]] += 1
    return starts, corners


@kernel
def smooth_patches(vertices, faces, starts, corners, least_cosine, areas, units):
    """A number for every face, the same for faces that hang together over edges of two faces that are no creases.

    The faces' doubled areas along their normals and their unit normals go to ``areas`` and ``units`` (m, 3).
    """
    parents = np.arange(len(faces))
    for f in range(len(faces)):
        a, b, c = get(vertices, faces[f, 0]), get(vertices, faces[f, 1]), get(vertices, faces[f, 2])
        area = cross(subtract(b, a), subtract(c, b))
        put(areas, f, area)
        put(units, f, scale(1.0 / norm(area), area) if norm(area) > 0.0 else (0.0, 0.0, 0.0))
    seen_from, first = np.full(len(vertices), -1), np.empty((len(vertices), 2), np.int64)
    faces_met = np.empty(len(vertices), np.int64)
    for v in range(len(vertices)):
        for at in range(starts[v], starts[v + 1]):
            f = corners[at] // 3
            for c in range(3):
                other = faces[f, c]
                if other > v:
                    if seen_from[other] != v:
                        seen_from[other], faces_met[other] = v, 0
                    if faces_met[other] < 2:
                        first[other, faces_met[other]] = f
                    faces_met[other] += 1
        for at in range(starts[v], starts[v + 1]):
            f = corners[at] // 3
            for c in range(3):
                other = faces[f, c]
                if other > v and faces_met[other] == 2 and first[other, 0] == f:
                    g = first[other, 1]
                    if dot(get(units, f), get(units, g)) > least_cosine:
                        parents[_root(parents, f)] = _root(parents, g)
    for f in range(len(faces)):
        parents[f] = _root(parents, f)
    return parents


@kernel
def _root(parents, f):
    while parents[f] != f:
        parents[f] = parents[parents[f]]
        f = parents[f]
    return f


@kernel
def split_vertices(faces, starts, corners, patches, areas):
    """Faces by drawn vertices, the vertex each of those stands for, and its normal; see ``shaded_corners``."""
    drawn = np.empty(faces.shape, np.int64)
    vertex_of, sums = np.empty(corners.size, np.int64), np.zeros((corners.size, 3))
    latest, count = np.full(len(faces), -1), 0
    for v in range(starts.size - 1):
        before = count
        for at in range(starts[v], starts[v + 1]):
            f, c = corners[at] // 3, corners[at] % 3
            patch = patches[f]
            if latest[patch] < before:  # not met at this vertex yet
                latest[patch], vertex_of[count] = count, v
                count += 1
            drawn[f, c] = latest[patch]
            put(sums, latest[patch], add(get(sums, latest[patch]), get(areas, f)))
    for k in range(count):
        length = norm(get(sums, k))
        if length > 0.0:
            put(sums, k, scale(1.0 / length, get(sums, k)))
    return drawn, vertex_of[:count], sums[:count]
