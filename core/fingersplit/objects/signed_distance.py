"""Signed distance to the object on a regular grid: what culls collision tests and pushes links away."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.objects.grid import PointGrid

__all__ = ["DistanceGrid", "build_distance_grid", "least_distance", "rough_distance", "sample_near"]

CELLS = 64
"""Along the longest side, the margin included."""
MARGIN = 0.04
"""[m]; around the object, since links are looked up before they touch."""
HALF_DIAGONAL = 0.87
"""Of a cell: what a point may be away from its nearest grid point."""
INSIDE_COSINE = -0.3
"""A cell counts as inside when its offset from the nearest sample points this much against the normal: beyond a sharp
edge offsets stand across the normals, so zero would put parts of the outside inside."""


class DistanceGrid(NamedTuple):
    """Signed distances at the corners of cubic cells.

    Attributes:
        values: Distance to the nearest surface sample, negative inside, (nx, ny, nz) float32 [m].
        samples: That sample, (nx, ny, nz) int32.
        origin: Place of ``values[0, 0, 0]`` [m].
        cell: Edge length of a cell [m].
    """

    values: NDArray[np.float32]
    samples: NDArray[np.int32]
    origin: tuple[float, float, float]
    cell: float


def build_distance_grid(grid: PointGrid, normals: NDArray[np.float64]) -> DistanceGrid:
    """Distances from surface samples and their outward unit normals (n, 3).

    Nearest samples spread from cell to neighbouring cell in sweeps along all axes, so a distance may be taken to the
    second nearest sample; the error is far below the cell's size.
    """
    low, high = grid.points.min(axis=0) - MARGIN, grid.points.max(axis=0) + MARGIN
    cell = float((high - low).max() / CELLS)
    shape = np.ceil((high - low) / cell).astype(np.int64) + 1
    x, y, z = low.tolist()
    values, samples = np.empty(shape, np.float32), np.full(shape, -1, np.int32)
    _sweep(grid.points, normals, (x, y, z), cell, samples, values)
    for array in (values, samples):
        array.setflags(write=False)
    return DistanceGrid(values, samples, (x, y, z), cell)


@kernel
def _sweep(points, normals, origin, cell, nearest, values):
    """Nearest sample of every grid point into ``nearest``, signed distance into ``values``."""
    nx, ny, nz = values.shape
    values[:] = np.inf
    for i in range(len(points)):  # seeds: the corners of the cell that a sample lies in
        x = int((points[i, 0] - origin[0]) / cell)
        y = int((points[i, 1] - origin[1]) / cell)
        z = int((points[i, 2] - origin[2]) / cell)
        for corner in range(8):
            _offer(points, origin, cell, nearest, values, x + corner % 2, y + corner // 2 % 2, z + corner // 4, i)
    for sweep in range(8):
        dx, dy, dz = 1 - 2 * (sweep % 2), 1 - 2 * (sweep // 2 % 2), 1 - 2 * (sweep // 4)
        for a in range(nx):
            x = a if dx > 0 else nx - 1 - a
            for b in range(ny):
                y = b if dy > 0 else ny - 1 - b
                for c in range(nz):
                    z = c if dz > 0 else nz - 1 - c
                    for back in range(1, 8):  # the neighbours behind, straight and diagonal
                        u, v, w = x - dx * (back % 2), y - dy * (back // 2 % 2), z - dz * (back // 4)
                        if 0 <= u < nx and 0 <= v < ny and 0 <= w < nz:
                            _offer(points, origin, cell, nearest, values, x, y, z, nearest[u, v, w])
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                i, distance = nearest[x, y, z], math.sqrt(values[x, y, z])
                outwards = (
                    (origin[0] + x * cell - points[i, 0]) * normals[i, 0]
                    + (origin[1] + y * cell - points[i, 1]) * normals[i, 1]
                    + (origin[2] + z * cell - points[i, 2]) * normals[i, 2]
                )
                values[x, y, z] = -distance if outwards < INSIDE_COSINE * distance else distance


@kernel
def _offer(points, origin, cell, nearest, values, x, y, z, i):
    """Take sample ``i`` for a grid point if it is nearer than its present one; ``values`` holds squares here."""
    if i >= 0 and i != nearest[x, y, z]:
        a = origin[0] + x * cell - points[i, 0]
        b = origin[1] + y * cell - points[i, 1]
        c = origin[2] + z * cell - points[i, 2]
        squared = a * a + b * b + c * c
        if squared < values[x, y, z]:
            values[x, y, z], nearest[x, y, z] = squared, i


@kernel
def _nearest_cell(grid, point):
    """The grid point nearest to ``point``, and how many cells that is away along the worst axis."""
    nx, ny, nz = grid.values.shape
    fx = (point[0] - grid.origin[0]) / grid.cell
    fy = (point[1] - grid.origin[1]) / grid.cell
    fz = (point[2] - grid.origin[2]) / grid.cell
    x = int(min(max(fx + 0.5, 0.0), nx - 1.0))
    y = int(min(max(fy + 0.5, 0.0), ny - 1.0))
    z = int(min(max(fz + 0.5, 0.0), nz - 1.0))
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

    From the nearest grid point alone, so it is cheap and up to a cell too small.
    """
    index, beyond = _nearest_cell(grid, point)
    if beyond > 0.51:
        return MARGIN + (beyond - 0.5) * grid.cell
    return grid.values[index] - HALF_DIAGONAL * grid.cell
