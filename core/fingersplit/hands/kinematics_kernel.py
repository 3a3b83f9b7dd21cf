"""Kinematics of any hand whose fingers are chains of revolute joints, on ``HAND`` and ``POSE`` records."""

import math

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, column, cross, get, put, rotate, subtract, vector

__all__ = ["move_drivers", "move_fingers", "place_on_link", "place_shape"]


@kernel
def move_drivers(hand, pose):
    """Joints of ``pose`` from its drivers, q = S theta + q0, and all that ``move_fingers`` does."""
    if hand.uncoupled:
        pose.joints[:] = pose.drivers
    else:
        for j in range(hand.joint_count):
            pose.joints[j] = hand.coupling_offset[j]
            for a in range(hand.driver_count):
                pose.joints[j] += hand.coupling[j, a] * pose.drivers[a]
    move_fingers(hand, pose)


@kernel
def move_fingers(hand, pose):
    """Forward kinematics: links, pads and Jacobians of ``pose`` from its palm and joints."""
    for f in range(hand.chain_count):
        count = hand.joint_counts[f]
        position = vector(pose.palm_position)
        for j in range(count):
            angle = pose.joints[hand.joint_indices[f, j]]
            if j == 0:
                position = add(position, rotate(pose.palm_rotation, get(hand.positions[f], j)))
                _turn(pose.palm_rotation, hand.rotations[f, j], angle, pose.link_rotations[f, j])
            else:
                position = add(position, rotate(pose.link_rotations[f, j - 1], get(hand.positions[f], j)))
                _turn(pose.link_rotations[f, j - 1], hand.rotations[f, j], angle, pose.link_rotations[f, j])
            put(pose.link_positions[f], j, position)
        if f < hand.finger_count:
            last = pose.link_rotations[f, count - 1]
            put(pose.pads, f, add(position, rotate(last, get(hand.pad_positions, f))))
            put(pose.pad_normals, f, rotate(last, get(hand.pad_normals, f)))
            _set_jacobian(hand, pose, f)


@kernel
def _set_jacobian(hand, pose, f):
    """J_theta of a finger's pad: motion by each joint, summed over the joints that follow each of its drivers."""
    J, pad = pose.jacobians[f], get(pose.pads, f)
    if not hand.uncoupled:
        for k in range(hand.driver_counts[f]):
            J[0, k], J[1, k], J[2, k] = 0.0, 0.0, 0.0
    for j in range(hand.joint_counts[f]):
        axis = column(pose.link_rotations[f, j], 2)
        motion = cross(axis, subtract(pad, get(pose.link_positions[f], j)))
        if hand.uncoupled:
            J[0, j], J[1, j], J[2, j] = motion
        else:
            for k in range(hand.driver_counts[f]):
                share = hand.coupling[hand.joint_indices[f, j], hand.driver_indices[f, k]]
                for i in range(3):
                    J[i, k] += share * motion[i]


@kernel
def _turn(previous, rotation, angle, out):
    """``previous @ rotation @ rotation_about_z(angle)`` of (3, 3) arrays into ``out``, which is neither of them."""
    s, c = math.sin(angle), math.cos(angle)
    for i in range(3):
        x = previous[i, 0] * rotation[0, 0] + previous[i, 1] * rotation[1, 0] + previous[i, 2] * rotation[2, 0]
        y = previous[i, 0] * rotation[0, 1] + previous[i, 1] * rotation[1, 1] + previous[i, 2] * rotation[2, 1]
        out[i, 0], out[i, 1] = c * x + s * y, c * y - s * x
        out[i, 2] = previous[i, 0] * rotation[0, 2] + previous[i, 1] * rotation[1, 2] + previous[i, 2] * rotation[2, 2]


@kernel
def place_shape(hand, pose, shape, rotation):
    """``object_from_shape`` of a collision shape: its rotation into ``rotation`` (3, 3), its centre [m] returned."""
    finger, link = hand.shape_fingers[shape], hand.shape_links[shape]
    if finger < 0:
        _turn(pose.palm_rotation, hand.shape_rotations[shape], 0.0, rotation)
    else:
        _turn(pose.link_rotations[finger, link], hand.shape_rotations[shape], 0.0, rotation)
    return place_on_link(hand, pose, shape, get(hand.shape_positions, shape))


@kernel
def place_on_link(hand, pose, shape, local):
    """A point of the link that carries a shape, such as a covering sphere's centre, in the frame of ``pose`` [m]."""
    finger, link = hand.shape_fingers[shape], hand.shape_links[shape]
    if finger < 0:
        return add(vector(pose.palm_position), rotate(pose.palm_rotation, local))
    return add(get(pose.link_positions[finger], link), rotate(pose.link_rotations[finger, link], local))
