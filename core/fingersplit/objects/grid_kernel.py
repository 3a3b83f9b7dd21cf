"""Kernels over a `PointGrid`: building it, nearest points, neighbours, thinning, smoothing."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.grid import PointGrid

__all__ = [
    "build_grid",
    "cell_range",
    "column_in_ball",
    "nearest",
    "neighbour_cells",
    "neighbour_lists",
    "smooth_directions",
    "thin_evenly",
]


@kernel
def build_grid(points, cell):
    """Sort points (n, 3) [m] into cells of edge ``cell`` [m].

    Returns:
        The grid, and for each of its points the index in ``points``, (n,) int64; points of one cell keep their order.
    """
    low = (points[:, 0].min(), points[:, 1].min(), points[:, 2].min())
    shape = (
        int((points[:, 0].max() - low[0]) / cell) + 1,
        int((points[:, 1].max() - low[1]) / cell) + 1,
        int((points[:, 2].max() - low[2]) / cell) + 1,
    )
    starts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int32)
    cells = np.empty(len(points), np.int64)
    for i in range(len(points)):
        x = int((points[i, 0] - low[0]) / cell)
        y = int((points[i, 1] - low[1]) / cell)
        z = int((points[i, 2] - low[2]) / cell)
        cells[i] = (x * shape[1] + y) * shape[2] + z
        starts[cells[i] + 1] += 1
    for c in range(1, starts.size):
        starts[c] += starts[c - 1]
    filled, order = starts[:-1].copy(), np.empty(len(points), np.int64)
    for i in range(len(points)):
        order[filled[cells[i]]] = i
        filled[cells[i]] += 1
    return PointGrid(points[order], starts, low, shape, cell), order


@kernel
def nearest(grid, query, hint):
    """Index of the point closest to ``query`` (x, y, z) [m].

    Args:
        grid: ``PointGrid``.
        query: Any point in space, near or far.
        hint: Index of a point believed to be close, which saves time, or -1.

    Any point bounds the distance; then only the columns of cells that reach closer are searched.
    """
    best, squared = hint, np.inf
    if hint >= 0:
        squared = _squared_distance(grid.points, hint, query)
    reach = grid.cell
    if squared > reach * reach:
        best, squared = _search(grid, query, reach, best, squared)
        while best < 0:
            reach *= 2.0
            best, squared = _search(grid, query, reach, best, squared)
        if squared <= reach * reach:
            return best
    best, squared = _search(grid, query, math.sqrt(squared), best, squared)
    return best


@kernel
def _search(grid, query, reach, best, squared):
    """The closest point of the cells that a ball about ``query`` meets, unless ``best`` is closer."""
    low, high = cell_range(grid, query, reach)
    x0, y0, z0 = query[0] - grid.origin[0], query[1] - grid.origin[1], query[2] - grid.origin[2]
    for x in range(low[0], high[0]):
        dx = max(x * grid.cell - x0, x0 - (x + 1) * grid.cell, 0.0)
        for y in range(low[1], high[1]):
            dy = max(y * grid.cell - y0, y0 - (y + 1) * grid.cell, 0.0)
            left = squared - dx * dx - dy * dy
            if left > 0.0:
                row = (x * grid.shape[1] + y) * grid.shape[2]
                dz = math.sqrt(min(left, reach * reach))
                first, last = int(max((z0 - dz) / grid.cell, low[2])), int(min((z0 + dz) / grid.cell, high[2] - 1))
                for i in range(grid.starts[row + first], grid.starts[row + max(last + 1, first)]):
                    distance = _squared_distance(grid.points, i, query)
                    if distance < squared:
                        best, squared = i, distance
    return best, squared


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
def column_in_ball(grid, x, y, center, radius):
    """First and one past the last point of the cells in column (x, y) that a ball may meet; they are one run."""
    x0, y0, z0 = center[0] - grid.origin[0], center[1] - grid.origin[1], center[2] - grid.origin[2]
    dx = max(x * grid.cell - x0, x0 - (x + 1) * grid.cell, 0.0)
    dy = max(y * grid.cell - y0, y0 - (y + 1) * grid.cell, 0.0)
    left = radius * radius - dx * dx - dy * dy
    if left < 0.0:
        return 0, 0
    dz, row = math.sqrt(left), (x * grid.shape[1] + y) * grid.shape[2]
    low = min(max(int((z0 - dz) / grid.cell), 0), grid.shape[2])
    high = min(max(int((z0 + dz) / grid.cell) + 1, low), grid.shape[2])
    return grid.starts[row + low], grid.starts[row + high]


@kernel
def _squared_distance(points, i, query):
    dx, dy, dz = points[i, 0] - query[0], points[i, 1] - query[1], points[i, 2] - query[2]
    return dx * dx + dy * dy + dz * dz


@kernel
def neighbour_cells(grid, i):
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
def _cell_of(grid, i):
    x = int((grid.points[i, 0] - grid.origin[0]) / grid.cell)
    y = int((grid.points[i, 1] - grid.origin[1]) / grid.cell)
    z = int((grid.points[i, 2] - grid.origin[2]) / grid.cell)
    return (x * grid.shape[1] + y) * grid.shape[2] + z


@kernel
def _has_room(grid, newest, before, i, squared):
    """Whether no kept point is nearer to point ``i`` than the root of ``squared`` [m^2]."""
    xs, ys, zs = neighbour_cells(grid, i)
    for x in range(xs[0], xs[1]):
        for y in range(ys[0], ys[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for z in range(zs[0], zs[1]):
                j = newest[row + z]
                while j >= 0:
                    if _squared_distance(grid.points, j, grid.points[i]) < squared:
                        return False
                    j = before[j]
    return True


@kernel
def thin_evenly(points, spacing):
    """Greedy Poisson-disk thinning: indices of points (n, 3) no two of which are closer than ``spacing`` [m].

    Points are taken in their order, so a random order gives an even cover.
    """
    grid, order = build_grid(points, spacing)
    place = np.empty_like(order)
    place[order] = np.arange(len(points))
    kept = np.zeros(len(points), np.bool_)
    # Kept points of every cell, as small as they can be: cells are many, and most of them stay out of the cache.
    newest, before = np.full(len(grid.starts) - 1, -1, np.int32), np.empty(len(points), np.int32)
    for i in place:
        if _has_room(grid, newest, before, i, spacing * spacing):
            kept[i] = True
            cell = _cell_of(grid, i)
            before[i], newest[cell] = newest[cell], i
    return np.sort(order[kept])


@kernel
def smooth_directions(grid, directions, radius, least_cosine):
    """Unit directions (n, 3) averaged over neighbours within ``radius`` <= the cell size [m].

    Neighbours that differ by more than the angle of ``least_cosine`` stay out, so sharp edges and the two sides of a
    thin plate do not blur; weights fall with distance as 1 - (d / radius)^2.
    """
    smooth = np.empty_like(directions)
    for i in range(len(directions)):
        sx, sy, sz = 0.0, 0.0, 0.0
        xs, ys, zs = neighbour_cells(grid, i)
        for x in range(xs[0], xs[1]):
            for y in range(ys[0], ys[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for j in range(grid.starts[row + zs[0]], grid.starts[row + zs[1]]):
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
        xs, ys, zs = neighbour_cells(grid, i)
        for x in range(xs[0], xs[1]):
            for y in range(ys[0], ys[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for j in range(grid.starts[row + zs[0]], grid.starts[row + zs[1]]):
                    if j != i and _squared_distance(grid.points, j, grid.points[i]) <= radius * radius:
                        if filled == found.size:
                            found = np.concatenate((found, np.empty_like(found)))
                        found[filled] = j
                        filled += 1
        starts[i + 1] = filled
    return starts, found[:filled]
