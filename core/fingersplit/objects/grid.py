"""Points binned in cubic cells: the search structure behind nearest points and collision."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel

__all__ = ["PointGrid", "build_grid", "cell_range", "nearest", "neighbour_lists", "smooth_directions", "thin_evenly"]


class PointGrid(NamedTuple):
    """Points sorted by cell.

    Attributes:
        points: The points, (n, 3) [m].
        origin: Lowest corner of the first cell, (3,) [m].
        cell: Edge length of a cell [m].
        shape: Number of cells along each axis, (3,) int64.
        starts: First entry of each cell in ``members``, one more than there are cells, int64.
        members: Point indices, cell after cell, (n,) int64.
    """

    points: NDArray[np.float64]
    origin: NDArray[np.float64]
    cell: float
    shape: NDArray[np.int64]
    starts: NDArray[np.int64]
    members: NDArray[np.int64]


@kernel
def build_grid(points, cell):
    """Bin points (n, 3) [m] in cells of edge ``cell`` [m], in their given order within a cell."""
    origin, shape = np.empty(3), np.empty(3, np.int64)
    for k in range(3):
        origin[k] = points[:, k].min()
        shape[k] = int((points[:, k].max() - origin[k]) / cell) + 1
    starts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    cells = np.empty(len(points), np.int64)
    for i in range(len(points)):
        cells[i] = _cell_number(points[i], origin, cell, shape)
        starts[cells[i] + 1] += 1
    for c in range(1, starts.size):
        starts[c] += starts[c - 1]
    filled, members = starts[:-1].copy(), np.empty(len(points), np.int64)
    for i in range(len(points)):
        members[filled[cells[i]]] = i
        filled[cells[i]] += 1
    return PointGrid(points, origin, cell, shape, starts, members)


@kernel
def _cell_number(point, origin, cell, shape):
    x = int((point[0] - origin[0]) / cell)
    y = int((point[1] - origin[1]) / cell)
    z = int((point[2] - origin[2]) / cell)
    return (x * shape[1] + y) * shape[2] + z


@kernel
def nearest(grid, query, hint):
    """Index of the point closest to ``query`` (x, y, z) [m].

    Args:
        grid: ``PointGrid``.
        query: Any point in space, near or far.
        hint: Index of a point believed to be close (a good one saves time, a bad one costs none), or -1.

    Cells are visited in growing cubic shells about the query's cell until the next shell cannot hold a closer point.
    """
    shape = grid.shape
    ix = int(np.floor((query[0] - grid.origin[0]) / grid.cell))
    iy = int(np.floor((query[1] - grid.origin[1]) / grid.cell))
    iz = int(np.floor((query[2] - grid.origin[2]) / grid.cell))
    first = max(_outside(ix, shape[0]), _outside(iy, shape[1]), _outside(iz, shape[2]))
    last = max(_reach(ix, shape[0]), _reach(iy, shape[1]), _reach(iz, shape[2]))
    best, best_squared = hint, np.inf
    if hint >= 0:
        best_squared = _squared_distance(grid.points, hint, query)
    for shell in range(first, last + 1):
        gap = (shell - 1) * grid.cell
        if shell > 0 and best_squared <= gap * gap:
            break
        for x in range(max(ix - shell, 0), min(ix + shell, shape[0] - 1) + 1):
            for y in range(max(iy - shell, 0), min(iy + shell, shape[1] - 1) + 1):
                on_side = abs(x - ix) == shell or abs(y - iy) == shell
                step = 1 if on_side else max(2 * shell, 1)
                for z in range(iz - shell, iz + shell + 1, step):
                    if 0 <= z < shape[2]:
                        c = (x * shape[1] + y) * shape[2] + z
                        for m in range(grid.starts[c], grid.starts[c + 1]):
                            squared = _squared_distance(grid.points, grid.members[m], query)
                            if squared < best_squared:
                                best, best_squared = grid.members[m], squared
    return best


@kernel
def cell_range(grid, query, reach):
    """First and one past the last cell that a ball about ``query`` meets, along each axis."""
    x, y, z = query[0] - grid.origin[0], query[1] - grid.origin[1], query[2] - grid.origin[2]
    nx, ny, nz = grid.shape
    low = (
        min(max(int((x - reach) / grid.cell), 0), nx),
        min(max(int((y - reach) / grid.cell), 0), ny),
        min(max(int((z - reach) / grid.cell), 0), nz),
    )
    high = (
        min(max(int((x + reach) / grid.cell) + 1, low[0]), nx),
        min(max(int((y + reach) / grid.cell) + 1, low[1]), ny),
        min(max(int((z + reach) / grid.cell) + 1, low[2]), nz),
    )
    return low, high


@kernel
def _outside(i, size):
    """Cells between a coordinate and the grid; 0 inside."""
    return max(-i, i - (size - 1), 0)


@kernel
def _reach(i, size):
    """Cells from a coordinate to the far end of the grid."""
    return max(i, size - 1 - i)


@kernel
def _squared_distance(points, i, query):
    dx, dy, dz = points[i, 0] - query[0], points[i, 1] - query[1], points[i, 2] - query[2]
    return dx * dx + dy * dy + dz * dz


@kernel
def _neighbour_cells(grid, i):
    """Index ranges of the 27 cells about point ``i``."""
    x = int((grid.points[i, 0] - grid.origin[0]) / grid.cell)
    y = int((grid.points[i, 1] - grid.origin[1]) / grid.cell)
    z = int((grid.points[i, 2] - grid.origin[2]) / grid.cell)
    return (
        (max(x - 1, 0), min(x + 2, grid.shape[0])),
        (max(y - 1, 0), min(y + 2, grid.shape[1])),
        (max(z - 1, 0), min(z + 2, grid.shape[2])),
    )


@kernel
def thin_evenly(points, spacing):
    """Greedy Poisson-disk thinning: indices of points (n, 3) no two of which are closer than ``spacing`` [m].

    Points are taken in their order, so a random order gives an even cover.
    """
    grid = build_grid(points, spacing)
    kept = np.zeros(len(points), np.bool_)
    for i in range(len(points)):
        xs, ys, zs = _neighbour_cells(grid, i)
        free = True
        for x in range(xs[0], xs[1]):
            for y in range(ys[0], ys[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for m in range(grid.starts[row + zs[0]], grid.starts[row + zs[1]]):
                    j = grid.members[m]
                    if kept[j] and _squared_distance(points, j, points[i]) < spacing * spacing:
                        free = False
                        break
        kept[i] = free
    return np.nonzero(kept)[0]


@kernel
def smooth_directions(grid, directions, radius, least_cosine):
    """Unit directions (n, 3) averaged over neighbours within ``radius`` <= the cell size [m].

    Neighbours that differ by more than the angle of ``least_cosine`` stay out, so sharp edges and the two sides of a
    thin plate do not blur; weights fall with distance as 1 - (d / radius)^2.
    """
    smooth = np.empty_like(directions)
    for i in range(len(directions)):
        sx, sy, sz = 0.0, 0.0, 0.0
        xs, ys, zs = _neighbour_cells(grid, i)
        for x in range(xs[0], xs[1]):
            for y in range(ys[0], ys[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for m in range(grid.starts[row + zs[0]], grid.starts[row + zs[1]]):
                    j = grid.members[m]
                    weight = 1.0 - _squared_distance(grid.points, j, grid.points[i]) / (radius * radius)
                    cosine = (
                        directions[i, 0] * directions[j, 0]
                        + directions[i, 1] * directions[j, 1]
                        + directions[i, 2] * directions[j, 2]
                    )
                    if weight > 0.0 and cosine >= least_cosine:
                        sx += weight * directions[j, 0]
                        sy += weight * directions[j, 1]
                        sz += weight * directions[j, 2]
        length = np.sqrt(sx * sx + sy * sy + sz * sz)
        smooth[i, 0], smooth[i, 1], smooth[i, 2] = sx / length, sy / length, sz / length
    return smooth


@kernel
def neighbour_lists(grid, radius):
    """Neighbours of every point within ``radius`` <= the cell size [m].

    Returns:
        First entry of each point's list, one more than there are points, and the lists, one after the other, int32.
    """
    n = len(grid.points)
    starts, found = np.zeros(n + 1, np.int32), np.empty(16 * n, np.int32)
    filled = 0
    for i in range(n):
        xs, ys, zs = _neighbour_cells(grid, i)
        for x in range(xs[0], xs[1]):
            for y in range(ys[0], ys[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for m in range(grid.starts[row + zs[0]], grid.starts[row + zs[1]]):
                    j = grid.members[m]
                    if j != i and _squared_distance(grid.points, j, grid.points[i]) <= radius * radius:
                        if filled == found.size:
                            found = np.concatenate((found, np.empty_like(found)))
                        found[filled] = j
                        filled += 1
        starts[i + 1] = filled
    return starts, found[:filled]
