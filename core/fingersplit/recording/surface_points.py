"""Points of the object that a recording shows: those inside the hand, and those that CPO aims at."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.recording.surface_points_kernel import mark_points_in_collision, nearest_points

__all__ = ["points_in_collision", "reference_points"]


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
