"""Unexpected contact: how deep surface points lie inside the links of the hand."""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kernel import place_shapes
from fingersplit.hands.shapes import bounding_radius, shape_distance
from fingersplit.objects.grid import cell_range
from fingersplit.objects.surface import touch
from fingersplit.vectors import add, cross, get, norm, rotate_back, scale, subtract

__all__ = ["penetration", "refined_penetration"]

DIRECTIONS = 8
"""Ways along the surface that the refinement tries from a point."""
HALVINGS = 5
"""Of the refinement's step, which starts at half the samples' spacing."""
LEAST_CLIMB = 1e-9
"""[m]; less is no progress."""
LEAST_REFINED = 1e-4
"""[m]; a link that samples show to be in the object by less than this is not looked at closer."""


@kernel
def penetration(hand, pose, grid):
    """Depth [m] of the deepest point of ``grid`` inside any link or the palm; 0 when all are outside.

    [Fan2018] section III-A3: points against links made of boxes, cylinders and capsules. A link that only meets cells
    without points costs next to nothing.
    """
    place_shapes(hand, pose)
    deepest = 0.0
    for k in range(hand.shape_kinds.size):
        center = get(pose.shape_positions, k)
        depth, _ = _deepest_in_shape(hand.shape_kinds[k], hand.shape_sizes[k], pose.shape_rotations[k], center, grid)
        deepest = max(deepest, depth)
    return deepest


@kernel
def refined_penetration(hand, pose, surface):
    """As ``penetration`` with every sample, but between them too: the depth [m] of the triangles inside the hand.

    In each shape the deepest sample climbs along the surface to the deepest point about it, by a pattern search.
    """
    place_shapes(hand, pose)
    deepest = 0.0
    for k in range(hand.shape_kinds.size):
        kind, size = hand.shape_kinds[k], hand.shape_sizes[k]
        rotation, center = pose.shape_rotations[k], get(pose.shape_positions, k)
        depth, sample = _deepest_in_shape(kind, size, rotation, center, surface.grid)
        if depth > LEAST_REFINED:
            depth = _climb(kind, size, rotation, center, surface, depth, sample)
        deepest = max(deepest, depth)
    return deepest


@kernel
def _climb(kind, size, rotation, center, surface, depth, sample):
    """Depth of the deepest point that a pattern search along the surface finds from a sample."""
    point, normal, step = get(surface.grid.points, sample), get(surface.normals, sample), 0.5 * surface.spacing
    first = cross(normal, (1.0, 0.0, 0.0) if abs(normal[0]) < 0.7 else (0.0, 1.0, 0.0))
    first = scale(1.0 / norm(first), first)
    second = cross(normal, first)
    for _ in range(HALVINGS):
        moved = True
        while moved:
            moved = False
            for k in range(DIRECTIONS):
                angle = 2.0 * math.pi * k / DIRECTIONS
                along = add(scale(step * math.cos(angle), first), scale(step * math.sin(angle), second))
                _, reached = touch(surface, add(point, along), sample)
                there = _depth(kind, size, rotation, subtract(reached, center))
                if there > depth + LEAST_CLIMB:
                    depth, point, moved = there, reached, True
        step *= 0.5
    return depth


@kernel
def _deepest_in_shape(kind, size, rotation, center, grid):
    """Depth [m] and index of the deepest point inside a shape; (0, -1) when none is inside."""
    radius = bounding_radius(kind, size)
    low, high = cell_range(grid, center, radius)
    deepest, index = 0.0, -1
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for m in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                offset = subtract(get(grid.points, grid.members[m]), center)
                if offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2 < radius * radius:
                    depth = _depth(kind, size, rotation, offset)
                    if depth > deepest:
                        deepest, index = depth, grid.members[m]
    return deepest, index


@kernel
def _depth(kind, size, rotation, offset):
    """How deep a point lies in a shape [m], negative outside; ``offset`` leads there from the shape's centre."""
    local = rotate_back(rotation, offset)
    return -shape_distance(kind, size, local[0], local[1], local[2])
