"""The kernels behind ``pose_links``."""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.vectors_kernel import get, put, vector

__all__ = ["move_hand", "pose_all_links"]


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
