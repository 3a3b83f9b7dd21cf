"""How deep the object lies inside the links, exact against its triangles: the last word on a finished grasp."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import place_on_link, place_shape
from fingersplit.hands.shapes_kernel import shape_distance, shape_distance_gradient
from fingersplit.objects.grid_kernel import cell_range, column_in_ball
from fingersplit.objects.patches_kernel import STACKED, halve_triangle
from fingersplit.objects.signed_distance_kernel import least_distance
from fingersplit.vectors_kernel import add, dot, get, put, rotate, rotate_back, scale, subtract

__all__ = ["ACCURACY", "exact_penetration"]

ACCURACY = 5e-6
"""[m]; the depth found may be too small by as much."""


@kernel
def exact_penetration(hand, pose, patches, distance, least):
    """Depth [m] of the deepest point of any triangle inside any link if it is more than ``least``.

    Depth inside a convex shape changes by no more than the way and is concave along a straight line, so its slope at a
    sample bounds it on the sample's patch. Triangles are looked at where that is not enough to stay within ``least``.

    Args:
        hand: ``HAND`` record.
        pose: ``POSE`` or ``STATE`` record that is up to date.
        patches: ``Patches`` of the object.
        distance: ``DistanceGrid`` of the object.
        least: Up to this depth [m] the deepest sample's is good enough; below zero it is a distance.

    Returns:
        The depth; that of the deepest sample if no triangle is deeper than ``least``.
    """
    sampled, deepest, rotation, stack = min(0.0, least), least, np.empty((3, 3)), np.empty((STACKED, 3, 3))
    away = max(-least, 0.0)
    for k in range(hand.shape_count):
        center = place_shape(hand, pose, k, rotation)
        if least_distance(distance, center) > hand.shape_radii[k] + away:
            continue
        shape = hand.shape_kinds[k], hand.shape_sizes[k], rotation, center
        for sphere in range(hand.sphere_starts[k], hand.sphere_starts[k + 1]):
            middle = place_on_link(hand, pose, k, get(hand.sphere_centers, sphere))
            if least_distance(distance, middle) < hand.sphere_radii[sphere] + away:
                reach = hand.sphere_radii[sphere] + patches.longest_reach + away
                sampled, deepest = _search_ball(shape, patches, middle, reach, sampled, deepest, stack)
    return deepest if deepest > least else sampled


@kernel
def _search_ball(shape, patches, middle, radius, sampled, deepest, stack):
    """The greatest depths about a point: of samples, and of the triangles about them where it is over ``deepest``."""
    kind, size, rotation, center = shape
    grid = patches.grid
    low, high = cell_range(grid, middle, radius)
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            first, last = column_in_ball(grid, x, y, middle, radius)
            for i in range(first, last):
                point = get(grid.points, i)
                offset = subtract(point, middle)
                if dot(offset, offset) > radius * radius:
                    continue
                local = rotate_back(rotation, subtract(point, center))
                depth = -shape_distance(kind, size, local[0], local[1], local[2])
                sampled, deepest = max(sampled, depth), max(deepest, depth)
                if depth + patches.longest_reach < deepest:
                    continue
                if _bound(shape, patches, i, local, depth) > deepest + ACCURACY:
                    for m in range(patches.starts[i], patches.starts[i + 1]):
                        deepest = _search_triangle(shape, patches, patches.members[m], deepest, stack)
    return sampled, deepest


@kernel
def _bound(shape, patches, i, local, depth):
    """A depth [m] that no point of sample ``i``'s patch exceeds, from the depth and its slope at the sample."""
    kind, size, rotation, _ = shape
    along = dot(get(patches.normals, i), rotate(rotation, shape_distance_gradient(kind, size, local)))
    across = math.sqrt(max(1.0 - along * along, 0.0))
    return depth + across * patches.reaches[i] + abs(along) * patches.plane_deviations[i]


@kernel
def _search_triangle(shape, patches, face, deepest, stack):
    """The greatest depth on a triangle, by halving it wherever its slope allows more than ``deepest``."""
    kind, size, rotation, center = shape
    for k in range(3):
        corner = get(patches.vertices, patches.faces[face, k])
        put(stack[0], k, rotate_back(rotation, subtract(corner, center)))
    waiting = 1
    while waiting > 0:
        waiting -= 1
        a, b, c = get(stack[waiting], 0), get(stack[waiting], 1), get(stack[waiting], 2)
        middle = scale(1.0 / 3.0, add(a, add(b, c)))
        depth = -shape_distance(kind, size, middle[0], middle[1], middle[2])
        outward = shape_distance_gradient(kind, size, middle)
        slopes = dot(outward, subtract(a, middle)), dot(outward, subtract(b, middle)), dot(outward, subtract(c, middle))
        bound = depth - min(slopes)
        deepest = max(deepest, depth)
        if bound > deepest + ACCURACY:
            corner = a if slopes[0] == min(slopes) else b if slopes[1] == min(slopes) else c
            deepest = max(deepest, -shape_distance(kind, size, corner[0], corner[1], corner[2]))
            if bound > deepest + ACCURACY and halve_triangle(stack, waiting, 0.0):
                waiting += 2
    return deepest
