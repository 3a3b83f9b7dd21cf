"""Kernels of `signed_distance`: building the grid and looking distances up."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.surface_kernel import distance_to_triangle
from fingersplit.vectors_kernel import dot, get, subtract

__all__ = ["MARGIN", "count_enclosures", "finish", "least_distance", "rough_distance", "sample_near", "spread_samples"]

MARGIN = 0.04
"""[m]; around the object, since links are looked up before they touch."""
_NEAR = 2.0  # cells; within these the distance to the triangle replaces that to its sample
SLACK = 1.25
"""[cells]; half a cell's diagonal, and what the distance at a grid point may be too large."""
_OFF_LATTICE = (0.0137, 0.0071)  # cells; rays beside the lattice miss the edges of meshes that were modelled on one


@kernel
def spread_samples(points, origin, cell, nearest, squares):
    """Index of the nearest sample of every grid point, and its squared distance.

    Samples seed the corners of their cells and spread from row to row of grid points in one sweep up and one down, so
    a grid point may get its second nearest sample; the error is far below a cell.
    """
    for i in range(len(points)):
        x = int((points[i, 0] - origin[0]) / cell)
        y = int((points[i, 1] - origin[1]) / cell)
        z = int((points[i, 2] - origin[2]) / cell)
        for corner in range(8):
            u, v, w = x + corner % 2, y + corner // 2 % 2, z + corner // 4
            offset = (origin[0] + u * cell - points[i, 0], origin[1] + v * cell - points[i, 1])
            squared = offset[0] ** 2 + offset[1] ** 2 + (origin[2] + w * cell - points[i, 2]) ** 2
            if squared < squares[u, v, w]:
                squares[u, v, w], nearest[u, v, w] = squared, i
    nx, ny, _ = nearest.shape
    for up in (1, -1):
        for a in range(nx):
            x = a if up > 0 else nx - 1 - a
            px = origin[0] + x * cell
            if a > 0:
                for y in range(ny):
                    py = origin[1] + y * cell
                    _offer(points, px, py, origin[2], cell, nearest[x - up, y], nearest[x, y], squares[x, y])
            for side in (1, -1):
                for b in range(ny):
                    y = b if side > 0 else ny - 1 - b
                    py = origin[1] + y * cell
                    if b > 0:
                        _offer(points, px, py, origin[2], cell, nearest[x, y - side], nearest[x, y], squares[x, y])
                    row, squared = nearest[x, y], squares[x, y]
                    _offer(points, px, py, origin[2] + cell, cell, row[:-1], row[1:], squared[1:])
                    last = origin[2] + (row.size - 2) * cell
                    _offer(points, px, py, last, -cell, row[:0:-1], row[-2::-1], squared[-2::-1])


@kernel
def _offer(points, x, y, z, step, offered, nearest, squares):
    """Take the offered samples for the grid points of a row at (x, y, z + k step), one by one, where they are nearer.

    Rows may overlap: a sample taken for one grid point is then offered to the next.
    """
    for k in range(nearest.size):
        i = offered[k]
        if i >= 0 and i != nearest[k]:
            a, b, c = x - points[i, 0], y - points[i, 1], z + k * step - points[i, 2]
            squared = a * a + b * b + c * c
            if squared < squares[k]:
                squares[k], nearest[k] = squared, i


@kernel
def count_enclosures(triangles, axis, low, cell, votes):
    """Add to ``votes`` (nx, ny, nz), for each grid point, how many of its two rays along an axis find it enclosed.

    Args:
        triangles: Corner points, counter-clockwise seen from outside, (n, 3, 3) [m].
        axis: 0, 1 or 2.
        low: Place of the first grid point, (3,) [m].
        cell: Distance of grid points [m].
        votes: Grows by 0, 1 or 2, int8.
    """
    u, v = (axis + 1) % 3, (axis + 2) % 3
    size = votes.shape
    steps = np.zeros((size[u], size[v], size[axis] + 1), np.int16)  # change of the enclosure at the next grid point
    shift = _OFF_LATTICE
    for t in range(len(triangles)):
        corners = triangles[t]
        au, av = (corners[0, u] - low[u]) / cell - shift[0], (corners[0, v] - low[v]) / cell - shift[1]
        bu, bv = (corners[1, u] - low[u]) / cell - shift[0], (corners[1, v] - low[v]) / cell - shift[1]
        cu, cv = (corners[2, u] - low[u]) / cell - shift[0], (corners[2, v] - low[v]) / cell - shift[1]
        doubled = (bu - au) * (cv - av) - (bv - av) * (cu - au)
        first_u, last_u = math.ceil(min(au, bu, cu)), math.floor(max(au, bu, cu))
        first_v, last_v = math.ceil(min(av, bv, cv)), math.floor(max(av, bv, cv))
        if first_u > last_u or first_v > last_v or doubled == 0.0:
            continue
        for i in range(max(first_u, 0), min(last_u, size[u] - 1) + 1):
            for j in range(max(first_v, 0), min(last_v, size[v] - 1) + 1):
                wa = ((bu - i) * (cv - j) - (bv - j) * (cu - i)) / doubled
                wb = ((cu - i) * (av - j) - (cv - j) * (au - i)) / doubled
                if wa >= 0.0 and wb >= 0.0 and wa + wb <= 1.0:
                    height = wa * corners[0, axis] + wb * corners[1, axis] + (1.0 - wa - wb) * corners[2, axis]
                    above = min(max(math.ceil((height - low[axis]) / cell), 0), size[axis])
                    steps[i, j, above] += -1 if doubled > 0.0 else 1
    for i in range(size[u]):
        for j in range(size[v]):
            total = 0
            for k in range(size[axis] + 1):
                total += steps[i, j, k]
            enclosed = 0
            for k in range(size[axis]):
                enclosed += steps[i, j, k]
                if enclosed > 0 or enclosed > total:
                    x, y, z = (k, i, j) if axis == 0 else (j, k, i) if axis == 1 else (i, j, k)
                    votes[x, y, z] += (1 if enclosed > 0 else 0) + (1 if enclosed > total else 0)


@kernel
def finish(points, normals, triangles, origin, cell, nearest, votes, values):
    """Squared distances to samples become signed distances to the surface."""
    nx, ny, nz = values.shape
    near = (_NEAR * cell) ** 2
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                i = nearest[x, y, z]
                place = (origin[0] + x * cell, origin[1] + y * cell, origin[2] + z * cell)
                distance = math.sqrt(values[x, y, z])
                if values[x, y, z] < near:
                    distance = distance_to_triangle(triangles[i], place)
                inside = votes[x, y, z] > 3
                if votes[x, y, z] == 3:
                    inside = dot(subtract(place, get(points, i)), get(normals, i)) < 0.0
                values[x, y, z] = -distance if inside else distance


@kernel
def _nearest_cell(grid, point):
    """The grid point nearest to ``point``, and how many cells that is away along the worst axis."""
    nx, ny, nz = grid.values.shape
    fx = (point[0] - grid.origin[0]) / grid.cell
    fy = (point[1] - grid.origin[1]) / grid.cell
    fz = (point[2] - grid.origin[2]) / grid.cell
    # Zero stands first so that a NaN becomes 0, too, instead of an index outside the array.
    x = int(min(max(0.0, fx + 0.5), nx - 1.0))
    y = int(min(max(0.0, fy + 0.5), ny - 1.0))
    z = int(min(max(0.0, fz + 0.5), nz - 1.0))
    return (x, y, z), max(abs(fx - x), abs(fy - y), abs(fz - z))


@kernel
def sample_near(grid, point):
    """A surface sample that is nearest to ``point``, or nearly so: a hint for an exact search."""
    return grid.samples[_nearest_cell(grid, point)[0]]


@kernel
def rough_distance(grid, point):
    """Signed distance [m] at the nearest grid point; outside the grid, the distance to it besides."""
    index, beyond = _nearest_cell(grid, point)
    return grid.values[index] + (beyond * grid.cell if beyond > 0.5 else 0.0)


@kernel
def least_distance(grid, point):
    """A distance [m] that the surface is certainly away from ``point``; negative inside or near the surface.

    From the nearest grid point alone, so it is cheap and up to two cells too small.
    """
    index, beyond = _nearest_cell(grid, point)
    if beyond > 0.51:
        return MARGIN + (beyond - 0.5) * grid.cell
    return grid.values[index] - SLACK * grid.cell
