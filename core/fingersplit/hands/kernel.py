"""Kinematics of any hand whose fingers are chains of two to four revolute joints.

A hand and a posed hand are one record each, with room for ``MAX_FINGERS`` fingers: kernels pass a record as a single
pointer, where a tuple of arrays would cost a copy and a reference count for every array at every call.
"""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors import add, column, cross, get, put, rotate, subtract, vector

__all__ = [
    "HAND",
    "MAX_FINGERS",
    "MAX_HAND_JOINTS",
    "MAX_JOINTS",
    "MAX_SHAPES",
    "MAX_SPHERES",
    "POSE",
    "POSE_FIELDS",
    "move_fingers",
    "place_on_link",
    "place_shape",
]

MAX_FINGERS, MAX_JOINTS, MAX_SHAPES, MAX_SPHERES = 5, 4, 32, 96
"""Most fingers, joints of one finger, collision shapes and covering spheres that the kernels are built for."""

MAX_HAND_JOINTS = MAX_FINGERS * MAX_JOINTS

HAND = np.dtype(
    [
        ("finger_count", np.int64),
        ("joint_count", np.int64),
        ("shape_count", np.int64),
        ("sphere_count", np.int64),
        ("joint_counts", np.int64, MAX_FINGERS),
        ("joint_indices", np.int64, (MAX_FINGERS, MAX_JOINTS)),
        ("rotations", np.float64, (MAX_FINGERS, MAX_JOINTS, 3, 3)),
        ("positions", np.float64, (MAX_FINGERS, MAX_JOINTS, 3)),
        ("pad_positions", np.float64, (MAX_FINGERS, 3)),
        ("pad_normals", np.float64, (MAX_FINGERS, 3)),
        ("pad_radii", np.float64, MAX_FINGERS),
        ("lower", np.float64, MAX_HAND_JOINTS),
        ("upper", np.float64, MAX_HAND_JOINTS),
        ("shape_kinds", np.int64, MAX_SHAPES),
        ("shape_fingers", np.int64, MAX_SHAPES),
        ("shape_links", np.int64, MAX_SHAPES),
        ("shape_rotations", np.float64, (MAX_SHAPES, 3, 3)),
        ("shape_positions", np.float64, (MAX_SHAPES, 3)),
        ("shape_sizes", np.float64, (MAX_SHAPES, 3)),
        ("shape_radii", np.float64, MAX_SHAPES),
        ("sphere_starts", np.int64, MAX_SHAPES + 1),
        ("sphere_shapes", np.int64, MAX_SPHERES),
        ("sphere_centers", np.float64, (MAX_SPHERES, 3)),
        ("sphere_radii", np.float64, MAX_SPHERES),
        ("sphere_insides", np.float64, MAX_SPHERES),
    ],
    align=True,
)
"""A hand as data: F fingers, N joints, K collision shapes, M spheres; frames follow the links from the palm outwards.

- ``joint_counts`` (F,), ``joint_indices`` (F, MAX_JOINTS): joints of each finger, and their places in the joint vector.
- ``rotations``, ``positions`` [m]: ``previous_from_joint`` at zero angle; a joint frame turns about its own z axis.
- ``pad_positions`` [m], ``pad_normals``, ``pad_radii`` [m]: spherical pad in the last link's frame, normal out of it.
- ``lower``, ``upper`` (N,): joint limits [rad].
- ``shape_kinds`` (see ``hands.shapes``), ``shape_fingers`` (-1 for the palm), ``shape_links`` (joint of that finger
  whose link carries the shape), ``link_from_shape`` as ``shape_rotations`` and ``shape_positions`` [m],
  ``shape_sizes`` [m]: half sizes as in MJCF, and ``shape_radii`` [m] about the centre.
- ``sphere_shapes``, ``sphere_centers`` [m] in the link frame, ``sphere_radii`` [m]: spheres that together enclose every
  shape, those of shape k from ``sphere_starts[k]`` to the next one's; with the radii ``sphere_insides`` [m] they lie
  inside it.
"""

POSE_FIELDS = [
    ("palm_rotation", np.float64, (3, 3)),
    ("palm_position", np.float64, 3),
    ("joints", np.float64, MAX_HAND_JOINTS),
    ("link_rotations", np.float64, (MAX_FINGERS, MAX_JOINTS, 3, 3)),
    ("link_positions", np.float64, (MAX_FINGERS, MAX_JOINTS, 3)),
    ("pads", np.float64, (MAX_FINGERS, 3)),
    ("pad_normals", np.float64, (MAX_FINGERS, 3)),
    ("jacobians", np.float64, (MAX_FINGERS, 3, MAX_JOINTS)),
]
"""Where a hand stands in some frame (here the object's).

``object_from_palm`` and ``joints`` [rad] are the input of ``move_fingers``; its output are ``object_from_link``, the
pad centres [m], the unit vectors out of the pads, and the pad centres by the finger's own joints, ``J_q2c,i`` of
[Fan2018] eq. (3b) [m/rad].
"""


POSE = np.dtype(POSE_FIELDS, align=True)


@kernel
def move_fingers(hand, pose):
    """Forward kinematics: links, pads and Jacobians of ``pose`` from its palm and joints."""
    for f in range(hand.finger_count):
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
        last = pose.link_rotations[f, count - 1]
        pad = add(position, rotate(last, get(hand.pad_positions, f)))
        put(pose.pads, f, pad)
        put(pose.pad_normals, f, rotate(last, get(hand.pad_normals, f)))
        for j in range(count):
            axis = column(pose.link_rotations[f, j], 2)
            motion = cross(axis, subtract(pad, get(pose.link_positions[f], j)))
            pose.jacobians[f, 0, j], pose.jacobians[f, 1, j], pose.jacobians[f, 2, j] = motion


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
