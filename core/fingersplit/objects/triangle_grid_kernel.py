"""Kernels of `triangle_grid`: binning triangles and casting rays."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import cross, get, norm, scale, subtract

__all__ = ["MARGIN", "cast", "face_normal", "fill_cells"]

MARGIN = 1e-6
"""Share of a cell by which triangles are binned more widely than they are, so that rounding loses no crossing."""


@kernel
def fill_cells(vertices, faces, origin, cell, shape):
    """``starts`` and ``members`` of the grid, by counting first."""
    starts = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int32)
    for face in range(len(faces)):
        low, high = _cells_of(vertices, faces, face, origin, cell, shape)
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                row = (x * shape[1] + y) * shape[2]
                for z in range(low[2], high[2] + 1):
                    starts[row + z] += 1
    total = 0
    for c in range(starts.size):  # each cell's end, which filling backwards turns into its start
        total += starts[c]
        starts[c] = total
    members = np.empty(total, np.int32)
    for face in range(len(faces) - 1, -1, -1):
        low, high = _cells_of(vertices, faces, face, origin, cell, shape)
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                row = (x * shape[1] + y) * shape[2]
                for z in range(low[2], high[2] + 1):
                    starts[row + z] -= 1
                    members[starts[row + z]] = face
    return starts, members


@kernel
def _cells_of(vertices, faces, face, origin, cell, shape):
    """First and last cell along each axis that the bounding box of a face meets."""
    a, b, c = get(vertices, faces[face, 0]), get(vertices, faces[face, 1]), get(vertices, faces[face, 2])
    return (
        (
            _cell_along(min(a[0], b[0], c[0]), origin[0], cell, -MARGIN, shape[0]),
            _cell_along(min(a[1], b[1], c[1]), origin[1], cell, -MARGIN, shape[1]),
            _cell_along(min(a[2], b[2], c[2]), origin[2], cell, -MARGIN, shape[2]),
        ),
        (
            _cell_along(max(a[0], b[0], c[0]), origin[0], cell, MARGIN, shape[0]),
            _cell_along(max(a[1], b[1], c[1]), origin[1], cell, MARGIN, shape[1]),
            _cell_along(max(a[2], b[2], c[2]), origin[2], cell, MARGIN, shape[2]),
        ),
    )


@kernel
def _cell_along(coordinate, origin, cell, margin, size):
    return min(max(int((coordinate - origin) / cell + margin), 0), size - 1)


@kernel
def cast(grid, origin, direction, longest, distances, faces):
    """The first crossings of a ray with the triangles, nearest first.

    Cell after cell along the ray [Amanatides1987]; a crossing counts in the cell where it lies, so none is found
    twice. A ray through an edge or a corner meets every face there: neighbours decide from the same products, so none
    slips between them [Woop2013].

    Args:
        grid: ``TriangleGrid``.
        origin: Where the ray starts [m].
        direction: Unit vector.
        longest: Length of the ray [m].
        distances: Gets the crossings' distances from the origin [m]; its size is the most that are looked for.
        faces: Gets the faces that are crossed.

    Returns:
        Number of crossings found.
    """
    entry, leave = _clip(grid, origin, direction, longest)
    if entry > leave:
        return 0
    axis, sx, sy, sz = _shear(direction)
    ox, oy, oz = origin[0] - grid.origin[0], origin[1] - grid.origin[1], origin[2] - grid.origin[2]
    x, step_x, next_x, delta_x = _walk(ox, direction[0], entry, grid.cell, grid.shape[0])
    y, step_y, next_y, delta_y = _walk(oy, direction[1], entry, grid.cell, grid.shape[1])
    z, step_z, next_z, delta_z = _walk(oz, direction[2], entry, grid.cell, grid.shape[2])
    found, capacity, since = 0, distances.size, 0.0
    while True:
        until = min(next_x, next_y, next_z)
        last = until > leave
        if last:
            until = math.nextafter(leave, math.inf)
        c = (x * grid.shape[1] + y) * grid.shape[2] + z
        for m in range(grid.starts[c], grid.starts[c + 1]):
            face = grid.members[m]
            distance = _crossing(grid.vertices, grid.faces, face, origin, axis, sx, sy, sz)
            if since <= distance < until:
                found = _insert(distances, faces, found, distance, face)
        if last or found == capacity:
            return found
        since = until
        if next_x == until:
            x, next_x = x + step_x, next_x + delta_x
        elif next_y == until:
            y, next_y = y + step_y, next_y + delta_y
        else:
            z, next_z = z + step_z, next_z + delta_z
        if not (0 <= x < grid.shape[0] and 0 <= y < grid.shape[1] and 0 <= z < grid.shape[2]):
            return found


@kernel
def _clip(grid, origin, direction, longest):
    """Part of the ray inside the grid, as distances from its origin [m]; the first is greater when it misses."""
    entry, leave = 0.0, longest
    for k in range(3):
        low = grid.origin[k] - origin[k]
        high = low + grid.shape[k] * grid.cell
        if direction[k] != 0.0:
            near, far = low / direction[k], high / direction[k]
            entry, leave = max(entry, min(near, far)), min(leave, max(near, far))
        elif low > 0.0 or high < 0.0:
            return 1.0, 0.0
    return entry, leave


@kernel
def _walk(start, slope, entry, cell, size):
    """Along one axis: first cell, step, distance to the next cell's wall and distance between walls [m]."""
    first = min(max(math.floor((start + entry * slope) / cell), 0), size - 1)
    if slope > 0.0:
        return first, 1, ((first + 1) * cell - start) / slope, cell / slope
    if slope < 0.0:
        return first, -1, (first * cell - start) / slope, -cell / slope
    return first, 0, math.inf, math.inf


@kernel
def _shear(direction):
    """The ray's main axis and the shear that turns the ray into that axis."""
    axis = 0
    for k in range(1, 3):
        if abs(direction[k]) > abs(direction[axis]):
            axis = k
    d = _turned(direction, axis)
    return axis, d[0] / d[2], d[1] / d[2], 1.0 / d[2]


@kernel
def _turned(v, axis):
    """Components turned so that ``axis`` comes last."""
    if axis == 2:
        return v[0], v[1], v[2]
    if axis == 0:
        return v[1], v[2], v[0]
    return v[2], v[0], v[1]


@kernel
def _sheared(vertices, vertex, origin, axis, sx, sy):
    """A corner seen along the ray: across, across, and along its main axis."""
    p = vertices[vertex, 0] - origin[0], vertices[vertex, 1] - origin[1], vertices[vertex, 2] - origin[2]
    p = _turned(p, axis)
    return p[0] - sx * p[2], p[1] - sy * p[2], p[2]


@kernel
def _crossing(vertices, faces, face, origin, axis, sx, sy, sz):
    """Distance along the ray to a face [m], infinite when it is missed or seen on edge."""
    a = _sheared(vertices, faces[face, 0], origin, axis, sx, sy)
    b = _sheared(vertices, faces[face, 1], origin, axis, sx, sy)
    c = _sheared(vertices, faces[face, 2], origin, axis, sx, sy)
    u = c[0] * b[1] - c[1] * b[0]
    v = a[0] * c[1] - a[1] * c[0]
    w = b[0] * a[1] - b[1] * a[0]
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return math.inf
    total = u + v + w
    if total == 0.0:
        return math.inf
    return sz * (u * a[2] + v * b[2] + w * c[2]) / total


@kernel
def _insert(distances, faces, found, distance, face):
    """Put a crossing in its place; the farthest falls out where there is no room."""
    if found == distances.size:
        if distance >= distances[found - 1]:
            return found
        found -= 1
    place = found
    while place > 0 and distances[place - 1] > distance:
        distances[place], faces[place] = distances[place - 1], faces[place - 1]
        place -= 1
    distances[place], faces[place] = distance, face
    return found + 1


@kernel
def face_normal(grid, face):
    """Unit normal of a face, out of the object."""
    corners = grid.faces[face]
    a, b, c = get(grid.vertices, corners[0]), get(grid.vertices, corners[1]), get(grid.vertices, corners[2])
    n = cross(subtract(b, a), subtract(c, a))
    return scale(1.0 / norm(n), n)
