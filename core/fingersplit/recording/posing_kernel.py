"""The kernels behind ``pose_links``, ``points_in_collision`` and ``reference_points``."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_fingers, place_on_link, place_shape
from fingersplit.hands.shapes_kernel import shape_distance
from fingersplit.objects.grid_kernel import cell_range
from fingersplit.objects.signed_distance_kernel import least_distance
from fingersplit.objects.surface_kernel import closest
from fingersplit.vectors_kernel import get, put, rotate_back, subtract, vector

__all__ = ["mark_points_in_collision", "move_hand", "nearest_points", "pose_all_links"]


@kernel
def move_hand(hand, pose, joints, palm_rotation, palm_position):
    """Kinematics of ``pose`` at joint angles (N,) [rad] and a palm pose, (3, 3) and (3,) [m]."""
    for j in range(hand.joint_count):
        pose.joints[j] = joints[j]
    for i in range(3):
        pose.palm_position[i] = palm_position[i]
        put(pose.palm_rotation, i, get(palm_rotation, i))
    move_fingers(hand, pose)


@kernel
def pose_all_links(hand, pose, places, joints, palm_rotations, palm_positions, xyzw, positions):
    """Poses of B links, given as (finger, joint) ``places``, in T states into ``xyzw`` and ``positions``."""
    for row in range(len(joints)):
        move_hand(hand, pose, joints[row], palm_rotations[row], palm_positions[row])
        for b in range(len(places)):
            finger, joint = places[b]
            if finger < 0:
                _put_quaternion(xyzw[b, row], pose.palm_rotation)
                put(positions[b], row, vector(pose.palm_position))
            else:
                _put_quaternion(xyzw[b, row], pose.link_rotations[finger, joint])
                put(positions[b], row, get(pose.link_positions[finger], joint))


@kernel
def _put_quaternion(xyzw, rotation):
    """The unit quaternion of a (3, 3) rotation, computed about its largest component."""
    trace, largest = rotation[0, 0] + rotation[1, 1] + rotation[2, 2], 3
    for i in range(3):
        if rotation[i, i] > trace:
            trace, largest = rotation[i, i], i
    if largest == 3:
        xyzw[3] = 1.0 + trace
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            xyzw[i] = rotation[k, j] - rotation[j, k]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        xyzw[i] = 1.0 + rotation[i, i] - rotation[j, j] - rotation[k, k]
        xyzw[j] = rotation[j, i] + rotation[i, j]
        xyzw[k] = rotation[k, i] + rotation[i, k]
        xyzw[3] = rotation[k, j] - rotation[j, k]
    length = math.sqrt(xyzw[0] ** 2 + xyzw[1] ** 2 + xyzw[2] ** 2 + xyzw[3] ** 2)
    for i in range(4):
        xyzw[i] /= length


@kernel
def mark_points_in_collision(hand, pose, joints, palm_rotations, palm_positions, grid, distance, inside):
    """Only points in the spheres that cover a shape are looked at, as in ``splitting.collision``."""
    rotation = np.empty((3, 3))
    for row in range(len(joints)):
        move_hand(hand, pose, joints[row], palm_rotations[row], palm_positions[row])
        for shape in range(hand.shape_count):
            center = place_on_link(hand, pose, shape, get(hand.shape_positions, shape))
            if least_distance(distance, center) < hand.shape_radii[shape]:
                place_shape(hand, pose, shape, rotation)
                for sphere in range(hand.sphere_starts[shape], hand.sphere_starts[shape + 1]):
                    middle = place_on_link(hand, pose, shape, get(hand.sphere_centers, sphere))
                    ball = middle, hand.sphere_radii[sphere]
                    if least_distance(distance, middle) < ball[1]:
                        kind, size = hand.shape_kinds[shape], hand.shape_sizes[shape]
                        _mark_in_shape(kind, size, rotation, center, grid, ball, inside[row])


@kernel
def _mark_in_shape(kind, size, rotation, center, grid, ball, inside):
    """Mark the points in a shape, of the cells that a ball (centre, radius [m]) meets."""
    low, high = cell_range(grid, ball[0], ball[1])
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for i in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                if not inside[i]:
                    local = rotate_back(rotation, subtract(get(grid.points, i), center))
                    inside[i] = shape_distance(kind, size, local[0], local[1], local[2]) < 0.0


@kernel
def nearest_points(surface, points, found):
    """The surface point nearest to each of ``points`` (n, 3) [m] into ``found``."""
    for i in range(len(points)):
        _, point, _ = closest(surface, get(points, i), -1)
        put(found, i, point)
