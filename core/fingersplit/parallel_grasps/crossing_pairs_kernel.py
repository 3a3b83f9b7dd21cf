"""Antipodal pairs from rays through the object: the kernel behind ``sample_antipodal``."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.objects.grid_kernel import cell_range, nearest
from fingersplit.objects.triangle_grid_kernel import cast, face_normal
from fingersplit.vectors_kernel import add, cross, dot, get, norm, put, scale, subtract

__all__ = ["across", "crossing_pairs"]

CROSSINGS = 16
"""Triangles that a ray is followed through."""
UNSEEN = 2.0
"""Spacings from the nearest sample beyond which a point is on a side of a cloud that was not seen."""
FACING_AWAY = -0.5
"""Cosine below which a neighbour's normal belongs to another side of the object."""
MIN_NORMAL_CONSISTENCY = 0.85
"""Mean cosine between the normals about a contact and its own below which it lies next to an edge."""


@kernel
def crossing_pairs(triangles, surface, draws, least_cosine, narrowest, widest):
    """Both ends of antipodal pairs, from one ray through the object a draw.

    A ray starts at a sample and runs inwards within the friction cone; wherever it leaves the object inside the
    friction cone of the far side, its ends are a pair. Both the triangles' normals and the smoothed ones must agree.

    Args:
        triangles: ``TriangleGrid``.
        surface: ``Surface``.
        draws: For each ray three numbers in [0, 1): where it starts, tilt and turn in the cone, (n, 3).
        least_cosine: Cosine of the friction cone's half angle.
        narrowest: Least distance of the two ends [m].
        widest: Greatest distance [m].

    Returns:
        Ends (n, 3) and (n, 3) [m], and how well jaws would sit there, (n,): the lowest of six cosines, at either end of
        the triangle's normal and of the smoothed normal to the jaw axis, and of the normals about it to its own, which
        falls towards an edge; less 1, so negative, where an end lies next to an edge.
    """
    count, samples, found = len(draws), len(surface.normals), 0
    room = CROSSINGS * count
    first, second, contact_scores = np.empty((room, 3)), np.empty((room, 3)), np.empty(room)
    distances, faces = np.empty(CROSSINGS), np.empty(CROSSINGS, np.int64)
    for ray in range(count):
        # Samples stand in the order of their cells: even steps through them are even steps over the surface.
        i = int(draws[ray, 0] * samples)
        origin, inward = get(surface.grid.points, i), scale(-1.0, get(surface.normals, i))
        direction = _within_cone(inward, least_cosine, draws[ray, 1], draws[ray, 2])
        flat = -dot(_triangle_normal(surface.triangles[i]), direction)
        if flat < least_cosine:
            continue
        near, consistency, judged = min(flat, dot(inward, direction)), 1.0, False
        crossings = cast(triangles, origin, direction, widest, distances, faces)
        for k in range(crossings):
            flat = dot(face_normal(triangles, faces[k]), direction)
            if distances[k] < narrowest or flat < least_cosine:
                continue
            end = add(origin, scale(distances[k], direction))
            j = nearest(surface.grid, end, -1)
            seen = norm(subtract(end, get(surface.grid.points, j))) <= UNSEEN * surface.spacing
            # Through a foil, the nearest sample may be one of the side that the ray came from, and says nothing.
            seen = seen and dot(get(surface.normals, j), direction) > FACING_AWAY
            smooth = dot(get(surface.normals, j), direction) if seen else flat
            if not judged:
                consistency, judged = _normal_consistency(surface, i), True
            end_consistency = _normal_consistency(surface, j) if seen else 1.0
            if smooth >= least_cosine:
                put(first, found, origin)
                put(second, found, end)
                score = min(near, flat, smooth, consistency, end_consistency)
                beside_edge = min(consistency, end_consistency) < MIN_NORMAL_CONSISTENCY
                contact_scores[found] = score - 1.0 if beside_edge else score
                found += 1
    return first[:found], second[:found], contact_scores[:found]


@kernel
def _within_cone(axis, least_cosine, tilt, turn):
    """Unit vector in the cone about a unit vector, evenly over the cone's cap for even ``tilt`` and ``turn``."""
    cosine = 1.0 - tilt * (1.0 - least_cosine)
    sine, angle = math.sqrt(1.0 - cosine * cosine), 2.0 * math.pi * turn
    aside = across(axis)
    turned = add(scale(sine * math.cos(angle), aside), scale(sine * math.sin(angle), cross(axis, aside)))
    return add(scale(cosine, axis), turned)


@kernel
def across(axis):
    """A unit vector perpendicular to a unit vector."""
    x, y, z = abs(axis[0]), abs(axis[1]), abs(axis[2])
    if x <= y and x <= z:
        aside = cross(axis, (1.0, 0.0, 0.0))
    elif y <= z:
        aside = cross(axis, (0.0, 1.0, 0.0))
    else:
        aside = cross(axis, (0.0, 0.0, 1.0))
    return scale(1.0 / norm(aside), aside)


@kernel
def _triangle_normal(corners):
    a, b, c = get(corners, 0), get(corners, 1), get(corners, 2)
    normal = cross(subtract(b, a), subtract(c, a))
    return scale(1.0 / norm(normal), normal)


@kernel
def _normal_consistency(surface, i):
    """Mean cosine between the normals about sample ``i`` and its own; the far side of a thin plate is left out."""
    grid, total, count = surface.grid, 0.0, 0
    point, normal = get(grid.points, i), get(surface.normals, i)
    low, high = cell_range(grid, point, grid.cell)
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for j in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                cosine = dot(get(surface.normals, j), normal)
                if cosine > FACING_AWAY and norm(subtract(get(grid.points, j), point)) <= grid.cell:
                    total += cosine
                    count += 1
    return total / count
