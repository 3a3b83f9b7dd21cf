"""Signed distance to the shapes of links: primitives, and convex solids given by planes and corners."""

import math

from fingersplit.compilation import kernel

__all__ = ["BOX", "CAPSULE", "CONVEX", "CYLINDER", "SPHERE", "shape_distance", "shape_distance_gradient"]

# The numbers are those of mujoco.mjtGeom.
SPHERE = 2
CAPSULE = 3
CYLINDER = 5
BOX = 6
CONVEX = 7


@kernel
def shape_distance(kind, size, x, y, z):
    """Signed distance [m] from a point in the shape's frame to its surface, negative inside.

    Sizes as in MJCF: sphere (radius), capsule and cylinder along z (radius, half length), box (half edges);
    convex solid (number of planes, number of corners, then outward normal and offset of each plane, then the corners).
    Outside of a convex solid it is the largest distance from a plane, which is never too large.
    """
    if kind == SPHERE:
        return math.sqrt(x * x + y * y + z * z) - size[0]
    if kind == CAPSULE:
        beyond = max(abs(z) - size[1], 0.0)
        return math.sqrt(x * x + y * y + beyond * beyond) - size[0]
    if kind == CONVEX:
        return _plane_distance(size, _farthest_plane(size, x, y, z), x, y, z)
    if kind == CYLINDER:
        a, b, c = math.sqrt(x * x + y * y) - size[0], abs(z) - size[1], -math.inf
    else:
        a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    inside = min(max(a, b, c), 0.0)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return inside + math.sqrt(a * a + b * b + c * c)


@kernel
def shape_distance_gradient(kind, size, point):
    """Unit gradient of ``shape_distance`` at a point in the shape's frame: the outward normal of the nearest face."""
    x, y, z = point
    if kind == SPHERE:
        return _unit(x, y, z)
    if kind == CAPSULE:
        z -= min(max(z, -size[1]), size[1])
        return _unit(x, y, z)
    if kind == CONVEX:
        at = 2 + 4 * _farthest_plane(size, x, y, z)
        return size[at], size[at + 1], size[at + 2]
    if kind == CYLINDER:
        radial = math.sqrt(x * x + y * y)
        a, c = radial - size[0], abs(z) - size[1]
        if max(a, c) <= 0.0:
            return _unit(x, y, 0.0) if a > c else (0.0, 0.0, math.copysign(1.0, z))
        out = max(a, 0.0) / radial if radial > 0.0 else 0.0
        return _unit(out * x, out * y, math.copysign(max(c, 0.0), z))
    a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    deepest = max(a, b, c)
    if deepest <= 0.0:
        return _unit(
            math.copysign(1.0, x) if a == deepest else 0.0,
            math.copysign(1.0, y) if b == deepest else 0.0,
            math.copysign(1.0, z) if c == deepest else 0.0,
        )
    return _unit(math.copysign(max(a, 0.0), x), math.copysign(max(b, 0.0), y), math.copysign(max(c, 0.0), z))


@kernel
def _farthest_plane(size, x, y, z):
    """The plane of a convex solid that a point lies farthest outside of, or least deep behind."""
    best, farthest = 0, -math.inf
    for plane in range(int(size[0])):
        distance = _plane_distance(size, plane, x, y, z)
        if distance > farthest:
            best, farthest = plane, distance
    return best


@kernel
def _plane_distance(size, plane, x, y, z):
    at = 2 + 4 * plane
    return size[at] * x + size[at + 1] * y + size[at + 2] * z + size[at + 3]


@kernel
def _unit(x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > 0.0 else (1.0, 0.0, 0.0)
