"""Where hand and object stand over many states at once: poses of links, points in collision, points aimed at."""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.recording.posing_kernel import mark_points_in_collision, nearest_points, pose_all_links

__all__ = ["HandLink", "Poses", "hand_links", "points_in_collision", "pose_links", "reference_points", "turn_z_to"]


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
    pose_all_links(hand.arrays, hand.pose(joints[0]), places, *states, *poses)
    return poses


def turn_z_to(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions xyzw (..., 4) of the shortest turns from the z axis to unit vectors (..., 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    quaternions = np.stack([-y, x, np.zeros_like(x), 1 + z], axis=-1)
    quaternions[z < -1 + 1e-9] = (1.0, 0.0, 0.0, 0.0)
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True))


def points_in_collision(
    hand: Hand,
    model: ObjectModel,
    joints: NDArray[np.float64],
    palm_rotations: NDArray[np.float64],
    palm_positions: NDArray[np.float64],
) -> list[NDArray[np.float64]]:
    """Collision points of the object that lie inside the hand, for every state.

    Args:
        hand: The hand.
        model: The object.
        joints: Joint angles, (T, N) [rad].
        palm_rotations: ``object_from_palm`` rotations, (T, 3, 3).
        palm_positions: Palm origins, (T, 3) [m].

    Returns:
        For each state the points inside, (n, 3) [m].
    """
    inside = np.zeros((len(joints), len(model.collision.points)), dtype=np.bool_)
    states = np.array(joints), np.array(palm_rotations), np.array(palm_positions)
    pose = hand.pose(np.zeros(joints.shape[1]))
    mark_points_in_collision(hand.arrays, pose, *states, model.collision, model.distance, inside)
    return [model.collision.points[row] for row in inside]


def reference_points(model: ObjectModel, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The surface point nearest to each of ``points`` (n, 3) [m], (n, 3) [m]."""
    found = np.empty_like(points)
    nearest_points(model.surface, np.ascontiguousarray(points), found)
    return found
