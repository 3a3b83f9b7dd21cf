"""Distance between two primitive shapes and their nearest points: GJK on their cores [Gilbert1988, Ericson2005].

A sphere is a point and a capsule a segment, each with a radius; all other shapes are their own cores. Distances are
exact to ``ACCURACY``. Where cores overlap, the depth is the least overlap along some axes, which is never too small.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CONVEX, CYLINDER, SPHERE
from fingersplit.vectors_kernel import add, column, cross, dot, get, norm, put, rotate, rotate_back, scale, subtract

__all__ = ["GJK_ROWS", "core_extent", "shape_to_shape"]

ACCURACY = 1e-6
"""[m]"""
ITERATIONS = 48
GJK_ROWS = 12
"""Rows (3 numbers each) of the scratch array: four corners of the simplex, and of both shapes for each."""
PARALLEL = 1e-9


@kernel
def shape_to_shape(kind, size, rotation, center, other_kind, other_size, other_rotation, other_center, reach, rows):
    """Signed distance of two shapes, nearest point of the other one, and the direction from this one to it.

    Args:
        kind: ``hands.shapes`` kind of this shape.
        size: Its half sizes, (3,) [m].
        rotation: Its rotation, (3, 3).
        center: Its centre [m].
        other_kind: The same of the other shape.
        other_size: Likewise.
        other_rotation: Likewise.
        other_center: Likewise.
        reach: A distance beyond which nothing but that it is farther matters [m].
        rows: Scratch, (GJK_ROWS, 3).

    Returns:
        Distance [m], negative where they overlap, infinite beyond ``reach``; point [m] and unit direction.
    """
    radii = _core_radius(kind, size) + _core_radius(other_kind, other_size)
    v = subtract(center, other_center)
    if dot(v, v) == 0.0:
        v = (1.0, 0.0, 0.0)
    count = 0
    for _ in range(ITERATIONS):
        length = norm(v)
        if length < ACCURACY:
            return _overlap(kind, size, rotation, center, other_kind, other_size, other_rotation, other_center, radii)
        back = scale(-1.0, v)
        a = _support(kind, size, rotation, center, back)
        b = _support(other_kind, other_size, other_rotation, other_center, v)
        w = subtract(a, b)
        least = dot(v, w) / length  # no point of the difference is nearer to the origin
        if least - radii > reach:
            return math.inf, other_center, v
        if count > 0 and length - least < ACCURACY:
            break
        put(rows, count, w)
        put(rows, 4 + count, a)
        put(rows, 8 + count, b)
        count, v = _nearest_of_simplex(rows, count + 1)
        if count == 4:
            return _overlap(kind, size, rotation, center, other_kind, other_size, other_rotation, other_center, radii)
    length = norm(v)
    away = scale(-1.0 / length, v)
    point = _witness(rows, count, v, 8)
    return length - radii, add(point, scale(-_core_radius(other_kind, other_size), away)), away


@kernel
def core_extent(kind, size, rotation, direction):
    """How far a shape reaches from its centre along a unit direction [m], the radius included."""
    local = rotate_back(rotation, direction)
    if kind == BOX:
        return size[0] * abs(local[0]) + size[1] * abs(local[1]) + size[2] * abs(local[2])
    if kind == CONVEX:
        back = scale(-1.0, local)
        return max(dot(local, _farthest_corner(size, local)), dot(back, _farthest_corner(size, back)))
    if kind == CYLINDER:
        return size[0] * math.sqrt(local[0] ** 2 + local[1] ** 2) + size[1] * abs(local[2])
    return size[0] + (size[1] * abs(local[2]) if kind == CAPSULE else 0.0)


@kernel
def _core_radius(kind, size):
    return size[0] if kind in (SPHERE, CAPSULE) else 0.0


@kernel
def _support(kind, size, rotation, center, direction):
    """The point of a shape's core that lies farthest along a direction."""
    if kind == SPHERE:
        return center
    x, y, z = rotate_back(rotation, direction)
    if kind == BOX:
        local = (math.copysign(size[0], x), math.copysign(size[1], y), math.copysign(size[2], z))
    elif kind == CONVEX:
        local = _farthest_corner(size, (x, y, z))
    elif kind == CAPSULE:
        local = (0.0, 0.0, math.copysign(size[1], z))
    else:
        across = math.sqrt(x * x + y * y)
        factor = size[0] / across if across > 0.0 else 0.0
        local = (factor * x, factor * y, math.copysign(size[1], z))
    return add(center, rotate(rotation, local))


@kernel
def _corner(size, i):
    """Corner ``i`` of a convex solid, in its own frame."""
    at = 2 + 4 * int(size[0]) + 3 * i
    return size[at], size[at + 1], size[at + 2]


@kernel
def _farthest_corner(size, direction):
    best, farthest = 0, -math.inf
    for i in range(int(size[1])):
        height = dot(direction, _corner(size, i))
        if height > farthest:
            best, farthest = i, height
    return _corner(size, best)


@kernel
def _overlap(kind, size, rotation, center, other_kind, other_size, other_rotation, other_center, radii):
    """Least overlap along shapes' axes, the line of centres, normals of boxes' edges and planes of convex solids."""
    offset = subtract(other_center, center)
    planes = int(size[0]) if kind == CONVEX else 0
    other_planes = int(other_size[0]) if other_kind == CONVEX else 0
    best, away = math.inf, (0.0, 0.0, 1.0)
    for i in range(16 + planes + other_planes):
        if i < 3:
            axis = column(rotation, i)
        elif i < 6:
            axis = column(other_rotation, i - 3)
        elif i == 6:
            axis = offset
        elif i < 16:
            axis = cross(column(rotation, (i - 7) // 3), column(other_rotation, (i - 7) % 3))
        elif i < 16 + planes:
            axis = rotate(rotation, _normal(size, i - 16))
        else:
            axis = scale(-1.0, rotate(other_rotation, _normal(other_size, i - 16 - planes)))
        length = norm(axis)
        if length < PARALLEL:
            continue
        turned = dot(axis, offset) < 0.0 and i < 16  # planes of a solid look out of it
        axis = scale((-1.0 if turned else 1.0) / length, axis)
        depth = _reach(kind, size, rotation, axis) + _reach(other_kind, other_size, other_rotation, scale(-1.0, axis))
        depth -= dot(axis, offset)
        if depth < best:
            best, away = depth, axis
    back = scale(-1.0, away)
    point = _support(other_kind, other_size, other_rotation, other_center, back)
    return min(-best, -radii), add(point, scale(_core_radius(other_kind, other_size), back)), away


@kernel
def _reach(kind, size, rotation, direction):
    """How far a shape reaches from its centre along a unit direction [m], on that side alone."""
    if kind == CONVEX:
        local = rotate_back(rotation, direction)
        return dot(local, _farthest_corner(size, local))
    return core_extent(kind, size, rotation, direction)


@kernel
def _normal(size, i):
    """Outward normal of plane ``i`` of a convex solid, in its own frame."""
    at = 2 + 4 * i
    return size[at], size[at + 1], size[at + 2]


@kernel
def _witness(rows, count, v, first):
    """The point of one shape that belongs to the nearest point ``v`` of the simplex."""
    if count == 1:
        return get(rows, first)
    a, b = get(rows, 0), get(rows, 1)
    if count == 2:
        edge = subtract(b, a)
        t = dot(subtract(v, a), edge) / dot(edge, edge)
        return add(scale(1.0 - t, get(rows, first)), scale(t, get(rows, first + 1)))
    u, w, r = subtract(b, a), subtract(get(rows, 2), a), subtract(v, a)
    uu, uw, ww, ru, rw = dot(u, u), dot(u, w), dot(w, w), dot(r, u), dot(r, w)
    determinant = uu * ww - uw * uw
    if determinant <= 0.0:
        return get(rows, first)
    s, t = (ww * ru - uw * rw) / determinant, (uu * rw - uw * ru) / determinant
    point = add(scale(1.0 - s - t, get(rows, first)), scale(s, get(rows, first + 1)))
    return add(point, scale(t, get(rows, first + 2)))


@kernel
def _nearest_of_simplex(rows, count):
    """The point of a simplex nearest to the origin; the corners that do not span it are dropped from ``rows``.

    Returns:
        Corners that are left (4 when the origin lies inside) and the nearest point.
    """
    if count == 1:
        return 1, get(rows, 0)
    if count == 2:
        return _nearest_of_segment(rows)
    if count == 3:
        return _nearest_of_triangle(rows)
    best, kept, point = math.inf, 4, (0.0, 0.0, 0.0)
    a, b, c, d = get(rows, 0), get(rows, 1), get(rows, 2), get(rows, 3)
    volume = dot(cross(subtract(b, a), subtract(c, a)), subtract(d, a))
    inside = abs(volume) > 1e-18
    best_face = -1
    for face in range(4):
        p, q, r = _face(face, a, b, c, d)
        opposite = (d, c, b, a)[face]
        normal = cross(subtract(q, p), subtract(r, p))
        if dot(normal, subtract(opposite, p)) * -dot(normal, p) >= 0.0 and abs(volume) > 1e-18:
            continue  # the origin lies on the inner side of this face
        inside = False
        _, near = _nearest_on(p, q, r)
        if dot(near, near) < best:
            best, best_face = dot(near, near), face
    if inside or best_face < 0:
        return 4, (0.0, 0.0, 0.0)
    for first in (0, 4, 8):
        a, b, c, d = get(rows, first), get(rows, first + 1), get(rows, first + 2), get(rows, first + 3)
        p, q, r = _face(best_face, a, b, c, d)
        put(rows, first, p)
        put(rows, first + 1, q)
        put(rows, first + 2, r)
    kept, point = _nearest_of_triangle(rows)
    return kept, point


@kernel
def _face(face, a, b, c, d):
    if face == 0:
        return a, b, c
    if face == 1:
        return a, b, d
    return (a, c, d) if face == 2 else (b, c, d)


@kernel
def _nearest_of_segment(rows):
    a, b = get(rows, 0), get(rows, 1)
    edge = subtract(b, a)
    squared = dot(edge, edge)
    t = -dot(a, edge) / squared if squared > 0.0 else 0.0
    if t >= 1.0:
        _keep(rows, 1, 1, 1)
        return 1, b
    if t <= 0.0:
        return 1, a
    return 2, add(a, scale(t, edge))


@kernel
def _nearest_of_triangle(rows):
    case, point = _nearest_on(get(rows, 0), get(rows, 1), get(rows, 2))
    if case < 3:
        _keep(rows, case, case, case)
        return 1, point
    if case < 6:
        first, second = ((0, 1), (0, 2), (1, 2))[case - 3]
        _keep(rows, first, second, second)
        return 2, point
    return 3, point


@kernel
def _keep(rows, i, j, k):
    """Move corners i <= j <= k of the simplex to the front."""
    for first in (0, 4, 8):
        put(rows, first, get(rows, first + i))
        put(rows, first + 1, get(rows, first + j))
        put(rows, first + 2, get(rows, first + k))


@kernel
def _nearest_on(a, b, c):
    """Nearest point of a triangle to the origin, and where it is: corner 0 to 2, edge ab 3, ac 4, bc 5, inside 6."""
    ab, ac = subtract(b, a), subtract(c, a)
    d1, d2 = -dot(ab, a), -dot(ac, a)
    if d1 <= 0.0 and d2 <= 0.0:
        return 0, a
    d3, d4 = -dot(ab, b), -dot(ac, b)
    if d3 >= 0.0 and d4 <= d3:
        return 1, b
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return 3, add(a, scale(d1 / (d1 - d3), ab))
    d5, d6 = -dot(ab, c), -dot(ac, c)
    if d6 >= 0.0 and d5 <= d6:
        return 2, c
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return 4, add(a, scale(d2 / (d2 - d6), ac))
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return 5, add(b, scale((d4 - d3) / ((d4 - d3) + (d5 - d6)), subtract(c, b)))
    total = va + vb + vc
    return 6, add(a, add(scale(vb / total, ab), scale(vc / total, ac)))
