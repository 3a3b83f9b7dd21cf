"""Where the links of a hand stand over many states at once, as viewers take it: positions and quaternions ``xyzw``."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.hands.hand import Hand
from fingersplit.hands.kernel import move_fingers
from fingersplit.vectors import get, put, vector

__all__ = ["HandLink", "Poses", "hand_links", "move_hand", "pose_links", "turn_z_to"]


@dataclass(frozen=True)
class HandLink:
    """A body of a hand.

    Attributes:
        name: ``"palm"``, or the finger and the number of the link, ``"finger1/link_1"``.
        finger: Finger that it belongs to, -1 for the palm.
        joint: Joint of that finger whose link it is.
        shapes: Collision primitives that it carries.
    """

    name: str
    finger: int
    joint: int
    shapes: tuple[int, ...]


class Poses(NamedTuple):
    """Where B bodies stand in T rows: ``xyzw`` (B, T, 4) and ``positions`` (B, T, 3) [m]."""

    xyzw: NDArray[np.float64]
    positions: NDArray[np.float64]


@lru_cache(maxsize=8)
def hand_links(hand: Hand) -> tuple[HandLink, ...]:
    """The bodies of a hand that carry shapes."""
    count = hand.arrays.shape_count
    carriers = list(zip(hand.arrays.shape_fingers[:count].tolist(), hand.arrays.shape_links.tolist(), strict=False))
    return tuple(
        HandLink(
            name="palm" if finger < 0 else f"{hand.fingers[finger].name}/link_{joint + 1}",
            finger=finger,
            joint=joint,
            shapes=tuple(shape for shape, carrier in enumerate(carriers) if carrier == (finger, joint)),
        )
        for finger, joint in dict.fromkeys(carriers)
    )


def pose_links(
    hand: Hand, joints: NDArray[np.float64], palm_rotations: NDArray[np.float64], palm_positions: NDArray[np.float64]
) -> Poses:
    """Poses of ``hand_links`` in the frame the palm is given in.

    Args:
        hand: The hand.
        joints: Joint angles, (T, N) [rad].
        palm_rotations: ``object_from_palm`` rotations, (T, 3, 3).
        palm_positions: Palm origins, (T, 3) [m].
    """
    links = hand_links(hand)
    places = np.array([(link.finger, link.joint) for link in links])
    poses = Poses(np.empty((len(links), len(joints), 4)), np.empty((len(links), len(joints), 3)))
    states = np.array(joints), np.array(palm_rotations), np.array(palm_positions)
    _pose_links(hand.arrays, hand.pose(joints[0]), places, *states, *poses)
    return poses


def turn_z_to(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions xyzw (..., 4) of the shortest turns from the z axis to unit vectors (..., 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    quaternions = np.stack([-y, x, np.zeros_like(x), 1 + z], axis=-1)
    quaternions[z < -1 + 1e-9] = (1.0, 0.0, 0.0, 0.0)
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True))


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
def _pose_links(hand, pose, places, joints, palm_rotations, palm_positions, xyzw, positions):
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
