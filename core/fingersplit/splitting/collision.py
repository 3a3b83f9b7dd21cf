"""Unexpected contact: how deep surface points lie inside the links of the hand."""

from fingersplit.compilation import kernel
from fingersplit.hands.shapes import bounding_radius, shape_distance
from fingersplit.objects.grid import cell_range
from fingersplit.vectors import add, get, rotate, rotate_back, subtract

__all__ = ["penetration"]


@kernel
def penetration(hand, pose, grid):
    """Depth [m] of the deepest point of ``grid`` inside any link or the palm; 0 when all are outside.

    [Fan2018] section III-A3: points against links made of boxes, cylinders and capsules. A link that only meets cells
    without points costs next to nothing.
    """
    deepest = 0.0
    for k in range(hand.shape_kinds.size):
        finger, link = hand.shape_fingers[k], hand.shape_links[k]
        if finger >= 0:
            rotation, position = pose.link_rotations[finger, link], get(pose.link_positions[finger], link)
        else:
            rotation = pose.palm_rotation
            position = (pose.palm_position[0], pose.palm_position[1], pose.palm_position[2])
        kind, size = hand.shape_kinds[k], hand.shape_sizes[k]
        center = add(position, rotate(rotation, get(hand.shape_positions, k)))
        radius = bounding_radius(kind, size)
        low, high = cell_range(grid, center, radius)
        for x in range(low[0], high[0]):
            for y in range(low[1], high[1]):
                row = (x * grid.shape[1] + y) * grid.shape[2]
                for m in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                    offset = subtract(get(grid.points, grid.members[m]), center)
                    if offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2 < radius * radius:
                        local = rotate_back(hand.shape_rotations[k], rotate_back(rotation, offset))
                        deepest = max(deepest, -shape_distance(kind, size, local[0], local[1], local[2]))
    return deepest
