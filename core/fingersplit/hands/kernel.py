"""Kinematics of any hand whose fingers are chains of two to four revolute joints, over plain arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.vectors import add, cross, get, multiply, put, rotate, set_rotation_about, subtract

__all__ = ["MAX_JOINTS", "HandArrays", "HandPose", "empty_pose", "move_fingers", "place_shapes"]

MAX_JOINTS = 4
"""Most joints of one finger that the kernels are built for."""


class HandArrays(NamedTuple):
    """A hand as data: F fingers, N joints, K collision shapes; frames follow the links from the palm outwards.

    Attributes:
        joint_counts: Joints of each finger, (F,) int64.
        joint_indices: Place of a finger's joints in the hand's joint vector, (F, MAX_JOINTS) int64.
        rotations: ``previous_from_joint`` at zero angle, (F, MAX_JOINTS, 3, 3).
        positions: Origin of each joint frame in the previous one, (F, MAX_JOINTS, 3) [m].
        axes: Unit joint axes in their joint frame, (F, MAX_JOINTS, 3).
        pad_positions: Centre of the spherical pad in the last link's frame, (F, 3) [m].
        pad_normals: Unit vector out of the pad in the last link's frame, (F, 3).
        pad_radii: Pad radius, (F,) [m].
        lower: Lower joint limits, (N,) [rad].
        upper: Upper joint limits, (N,) [rad].
        shape_kinds: Shape of each collision primitive, see ``hands.shapes``, (K,) int64.
        shape_fingers: Finger that carries the shape, -1 for the palm, (K,) int64.
        shape_links: Joint of that finger whose link carries the shape, (K,) int64.
        shape_rotations: ``link_from_shape``, (K, 3, 3).
        shape_positions: Shape centre in the link frame, (K, 3) [m].
        shape_sizes: Half sizes as in MJCF: box (x, y, z), capsule and cylinder (radius, half length), (K, 3) [m].
    """

    joint_counts: NDArray[np.int64]
    joint_indices: NDArray[np.int64]
    rotations: NDArray[np.float64]
    positions: NDArray[np.float64]
    axes: NDArray[np.float64]
    pad_positions: NDArray[np.float64]
    pad_normals: NDArray[np.float64]
    pad_radii: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    shape_kinds: NDArray[np.int64]
    shape_fingers: NDArray[np.int64]
    shape_links: NDArray[np.int64]
    shape_rotations: NDArray[np.float64]
    shape_positions: NDArray[np.float64]
    shape_sizes: NDArray[np.float64]


class HandPose(NamedTuple):
    """Where a hand stands in some frame (here the object's): input palm and joints, output of ``move_fingers``.

    Attributes:
        palm_rotation: ``object_from_palm`` rotation, (3, 3).
        palm_position: Palm origin, (3,) [m].
        joints: Joint angles, (N,) [rad].
        link_rotations: ``object_from_link``, (F, MAX_JOINTS, 3, 3).
        link_positions: Link origins, (F, MAX_JOINTS, 3) [m].
        pads: Pad centres, (F, 3) [m].
        pad_normals: Unit vectors out of the pads, (F, 3).
        jacobians: Pad centre by the finger's own joints, ``J_q2c,i`` of [Fan2018] eq. (3b),
            (F, 3, MAX_JOINTS) [m/rad].
        shape_rotations: ``object_from_shape`` of the collision primitives, output of ``place_shapes``, (K, 3, 3).
        shape_positions: Their centres, likewise, (K, 3) [m].
    """

    palm_rotation: NDArray[np.float64]
    palm_position: NDArray[np.float64]
    joints: NDArray[np.float64]
    link_rotations: NDArray[np.float64]
    link_positions: NDArray[np.float64]
    pads: NDArray[np.float64]
    pad_normals: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    shape_rotations: NDArray[np.float64]
    shape_positions: NDArray[np.float64]


@kernel
def empty_pose(hand):
    """A pose with the palm at the origin and all joints at zero, outputs unset."""
    fingers, joints, shapes = hand.joint_counts.size, hand.lower.size, hand.shape_kinds.size
    return HandPose(
        np.eye(3),
        np.zeros(3),
        np.zeros(joints),
        np.zeros((fingers, MAX_JOINTS, 3, 3)),
        np.zeros((fingers, MAX_JOINTS, 3)),
        np.zeros((fingers, 3)),
        np.zeros((fingers, 3)),
        np.zeros((fingers, 3, MAX_JOINTS)),
        np.zeros((shapes, 3, 3)),
        np.zeros((shapes, 3)),
    )


@kernel
def move_fingers(hand, pose, scratch):
    """Forward kinematics: links, pads and Jacobians of ``pose`` from its palm and joints.

    Args:
        hand: ``HandArrays``.
        pose: ``HandPose``, outputs overwritten.
        scratch: Two (3, 3) arrays, (2, 3, 3).
    """
    for finger in range(hand.joint_counts.size):
        count = hand.joint_counts[finger]
        rotation, position = pose.palm_rotation, (pose.palm_position[0], pose.palm_position[1], pose.palm_position[2])
        for j in range(count):
            position = add(position, rotate(rotation, get(hand.positions[finger], j)))
            multiply(rotation, hand.rotations[finger, j], scratch[0])
            set_rotation_about(get(hand.axes[finger], j), pose.joints[hand.joint_indices[finger, j]], scratch[1])
            multiply(scratch[0], scratch[1], pose.link_rotations[finger, j])
            put(pose.link_positions[finger], j, position)
            rotation = pose.link_rotations[finger, j]
        pad = add(position, rotate(rotation, get(hand.pad_positions, finger)))
        put(pose.pads, finger, pad)
        put(pose.pad_normals, finger, rotate(rotation, get(hand.pad_normals, finger)))
        for j in range(count):
            axis = rotate(pose.link_rotations[finger, j], get(hand.axes[finger], j))
            column = cross(axis, subtract(pad, get(pose.link_positions[finger], j)))
            for k in range(3):
                pose.jacobians[finger, k, j] = column[k]


@kernel
def place_shapes(hand, pose):
    """Rotations and centres of the collision primitives of a ``pose`` whose links are up to date."""
    for shape in range(hand.shape_kinds.size):
        finger, link = hand.shape_fingers[shape], hand.shape_links[shape]
        if finger >= 0:
            rotation, position = pose.link_rotations[finger, link], get(pose.link_positions[finger], link)
        else:
            rotation = pose.palm_rotation
            position = (pose.palm_position[0], pose.palm_position[1], pose.palm_position[2])
        multiply(rotation, hand.shape_rotations[shape], pose.shape_rotations[shape])
        put(pose.shape_positions, shape, add(position, rotate(rotation, get(hand.shape_positions, shape))))
