"""Unexpected contact: how far the links are from the object, and how deep its surface lies inside them."""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import place_on_link, place_shape
from fingersplit.hands.shapes_kernel import shape_distance, shape_distance_gradient
from fingersplit.objects.grid_kernel import cell_range
from fingersplit.objects.signed_distance_kernel import least_distance, rough_distance
from fingersplit.vectors_kernel import get, put, rotate, rotate_back, subtract

__all__ = ["RANGE", "measure_clearances", "rough_penetration"]

RANGE = 2.5e-3
"""[m]; a link farther from the object has no clearance to speak of."""


@kernel
def measure_clearances(hand, state, grid, distance, rotation):
    """Clearance of every collision shape from the points of ``grid``, and the deepest penetration, into ``state``.

    [Fan2018] section III-A3: points against links made of boxes, cylinders and capsules. The signed distance grid tells
    which of the spheres that cover a shape may meet the surface at all; only points inside those are looked at.

    Args:
        hand: ``HAND`` record.
        state: ``STATE`` record whose pose is up to date.
        grid: Points on the object's surface.
        distance: ``DistanceGrid`` of the object.
        rotation: Scratch, (3, 3).
    """
    state.penetration = 0.0
    for shape in range(hand.shape_count):
        state.clearances[shape] = math.inf
        center = place_on_link(hand, state, shape, get(hand.shape_positions, shape))
        if least_distance(distance, center) > hand.shape_radii[shape] + RANGE:
            continue
        place_shape(hand, state, shape, rotation)
        kind, size = hand.shape_kinds[shape], hand.shape_sizes[shape]
        nearest, point = RANGE, -1
        for sphere in range(hand.sphere_starts[shape], hand.sphere_starts[shape + 1]):
            middle = place_on_link(hand, state, shape, get(hand.sphere_centers, sphere))
            radius = hand.sphere_radii[sphere] + RANGE
            if least_distance(distance, middle) < radius:
                nearest, point = _nearest_to_shape(kind, size, rotation, center, grid, middle, radius, nearest, point)
        if point >= 0:
            met = get(grid.points, point)
            local = rotate_back(rotation, subtract(met, center))
            state.clearances[shape] = nearest
            put(state.clearance_points, shape, met)
            put(state.clearance_normals, shape, rotate(rotation, shape_distance_gradient(kind, size, local)))
            state.penetration = max(state.penetration, -nearest)


@kernel
def rough_penetration(hand, pose, distance, enough):
    """About how deep the hand is in the object [m], from spheres inside its links: cheap, and right to a few mm.

    What is ``enough`` [m] deep or more may be deeper than is returned.
    """
    deepest = 0.0
    for sphere in range(hand.sphere_count):
        middle = place_on_link(hand, pose, hand.sphere_shapes[sphere], get(hand.sphere_centers, sphere))
        deepest = max(deepest, hand.sphere_insides[sphere] - rough_distance(distance, middle))
        if deepest >= enough:
            return deepest
    return deepest


@kernel
def _nearest_to_shape(kind, size, rotation, center, grid, middle, radius, nearest, index):
    """The point of ``grid`` in a ball that is nearest to a shape, and its distance [m], unless ``index`` is nearer."""
    low, high = cell_range(grid, middle, radius)
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for i in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                point = get(grid.points, i)
                offset = subtract(point, middle)
                if offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2 < radius * radius:
                    local = rotate_back(rotation, subtract(point, center))
                    distance = shape_distance(kind, size, local[0], local[1], local[2])
                    if distance < nearest:
                        nearest, index = distance, i
    return nearest, index
