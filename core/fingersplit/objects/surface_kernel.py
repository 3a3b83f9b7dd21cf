"""Kernels of `surface`: creases, and the nearest point of the surface."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.grid_kernel import (
    cell_range,
    nearest,
    neighbour_cells,
)
from fingersplit.vectors_kernel import add, cross, dot, get, norm, scale, subtract

__all__ = ["MAX_OVERHANG", "closest", "distance_to_triangle", "find_creases", "touch"]

MAX_OVERHANG = 0.2e-3
"""[m]; a sample whose tangent plane leaves the surface by more, within a spacing, has a crease beside it."""


@kernel
def find_creases(grid, normals, radius, spacing):
    """Samples whose tangent plane, a spacing away, is ``MAX_OVERHANG`` beyond that of a sample within ``radius``.

    Two planes meet in a line; beyond it they part by the sine of the angle between their normals.
    """
    creased = np.zeros(len(normals), np.bool_)
    for i in range(len(normals)):
        sample, normal = get(grid.points, i), get(normals, i)
        xs, ys, zs = neighbour_cells(grid, i)
        for x in range(xs[0], xs[1]):
            for y in range(ys[0], ys[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for j in range(grid.starts[row + zs[0]], grid.starts[row + zs[1]]):
                    offset = subtract(get(grid.points, j), sample)
                    if dot(offset, offset) < radius * radius:
                        turned = norm(cross(normal, get(normals, j)))
                        if spacing * turned - abs(dot(offset, get(normals, j))) > MAX_OVERHANG:
                            creased[i] = True
    return creased


@kernel
def closest(surface, query, hint):
    """Nearest surface point: sample index, point [m] and outward normal.

    The point is the query's projection on the tangent plane of the nearest sample, at most one spacing away from it;
    with a crease beside the sample, it is the nearest point of the sample's triangle.
    """
    i = nearest(surface.grid, query, hint)
    sample, normal = get(surface.grid.points, i), get(surface.normals, i)
    if surface.creased[i]:
        return i, _closest_on_triangle(surface.triangles[i], query), normal
    offset = subtract(query, sample)
    tangential = subtract(offset, scale(dot(offset, normal), normal))
    length = norm(tangential)
    if length > surface.spacing:
        tangential = scale(surface.spacing / length, tangential)
    return i, add(sample, tangential), normal


@kernel
def touch(surface, query, hint):
    """Where a ball about ``query`` first touches the triangles: distance [m] and the point on the triangle [m].

    Exact over the triangles that carry a sample within one spacing of the nearest, that is all but those too small to
    matter: the distance errs by less than spacing^2 / (2 distance).
    """
    grid = surface.grid
    i = nearest(grid, query, hint)
    reach = norm(subtract(query, get(grid.points, i))) + surface.spacing
    low, high = cell_range(grid, query, reach)
    best, best_point = math.inf, query
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for j in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                if norm(subtract(query, get(grid.points, j))) <= reach:
                    point = _closest_on_triangle(surface.triangles[j], query)
                    distance = norm(subtract(query, point))
                    if distance < best:
                        best, best_point = distance, point
    return best, best_point


@kernel
def distance_to_triangle(triangle, query):
    """Distance [m] of a point from a triangle (3, 3) [m]."""
    return norm(subtract(query, _closest_on_triangle(triangle, query)))


@kernel
def _closest_on_triangle(triangle, query):
    """Closest point of a triangle (3, 3), by the Voronoi regions of its corners, edges and face [Ericson2005]."""
    a, b, c = get(triangle, 0), get(triangle, 1), get(triangle, 2)
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(query, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return a
    bp = subtract(query, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return b
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return add(a, scale(d1 / (d1 - d3), ab))
    cp = subtract(query, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return c
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return add(a, scale(d2 / (d2 - d6), ac))
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        return add(b, scale((d4 - d3) / ((d4 - d3) + (d5 - d6)), subtract(c, b)))
    normal = cross(ab, ac)
    return subtract(query, scale(dot(ap, normal) / dot(normal, normal), normal))
