"""Kernels of `solid`: where parallel lines cross a surface."""

import math

from fingersplit.compilation import kernel

__all__ = ["count_crossings", "find_crossings"]


@kernel
def count_crossings(vertices, faces, axis, low, steps, size):
    """How often lines along an axis cross the faces: an upper bound on the crossings that `find_crossings` finds."""
    total = 0
    for face in range(len(faces)):
        first_u, last_u, first_v, last_v = _lines_over(vertices, faces[face], axis, low, steps, size)
        total += max(last_u - first_u + 1, 0) * max(last_v - first_v + 1, 0)
    return total


@kernel
def find_crossings(vertices, faces, axis, low, steps, size, lines, heights, signs):
    """Crossings of the lines of a lattice along an axis with the faces.

    Args:
        vertices: (n, 3) [m].
        faces: Vertex indices, counter-clockwise seen from outside, (m, 3).
        axis: 0, 1 or 2; the lattice is spanned by the next two, u and v.
        low: Place of the first line along u and v [m].
        steps: Distance of lines along u and v [m].
        size: Number of lines along u and v.
        lines: Gets the line of each crossing, its u index times ``size[1]`` plus its v index, int64.
        heights: Gets its place along the axis [m].
        signs: Gets 1 where a line enters the object, -1 where it leaves it, int8.

    Returns:
        Number of crossings.
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    count = 0
    for face in range(len(faces)):
        first_u, last_u, first_v, last_v = _lines_over(vertices, faces[face], axis, low, steps, size)
        if first_u > last_u or first_v > last_v:
            continue
        a, b, c = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        au, av = (a[u] - low[0]) / steps[0], (a[v] - low[1]) / steps[1]
        bu, bv = (b[u] - low[0]) / steps[0], (b[v] - low[1]) / steps[1]
        cu, cv = (c[u] - low[0]) / steps[0], (c[v] - low[1]) / steps[1]
        doubled = (bu - au) * (cv - av) - (bv - av) * (cu - au)
        if doubled == 0.0:
            continue
        for i in range(first_u, last_u + 1):
            for j in range(first_v, last_v + 1):
                wa = ((bu - i) * (cv - j) - (bv - j) * (cu - i)) / doubled
                wb = ((cu - i) * (av - j) - (cv - j) * (au - i)) / doubled
                if wa >= 0.0 and wb >= 0.0 and wa + wb <= 1.0:
                    lines[count] = i * size[1] + j
                    heights[count] = wa * a[axis] + wb * b[axis] + (1.0 - wa - wb) * c[axis]
                    signs[count] = -1 if doubled > 0.0 else 1
                    count += 1
    return count


@kernel
def _lines_over(vertices, face, axis, low, steps, size):
    """First and last line along u and v that the bounding box of a face meets; none where the last is before."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    a, b, c = vertices[face[0]], vertices[face[1]], vertices[face[2]]
    return (
        max(math.ceil((min(a[u], b[u], c[u]) - low[0]) / steps[0]), 0),
        min(math.floor((max(a[u], b[u], c[u]) - low[0]) / steps[0]), size[0] - 1),
        max(math.ceil((min(a[v], b[v], c[v]) - low[1]) / steps[1]), 0),
        min(math.floor((max(a[v], b[v], c[v]) - low[1]) / steps[1]), size[1] - 1),
    )
