"""Where every part of a hand stands over many states at once."""

from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.hands.hand import Hand

__all__ = ["pose_shapes", "turn_z_to"]


def pose_shapes(
    hand: Hand, joints: NDArray[np.float64], palm_rotations: NDArray[np.float64], palm_positions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Poses of a hand's collision primitives in the frame the palm is given in.

    Args:
        hand: The hand.
        joints: Joint angles, (T, N) [rad].
        palm_rotations: ``object_from_palm`` rotations, (T, 3, 3).
        palm_positions: Palm origins, (T, 3) [m].

    Returns:
        Rotations (T, K, 3, 3) and centres (T, K, 3) [m].
    """
    arrays = hand.arrays
    links = {(-1, 0): (palm_rotations, palm_positions)}
    for finger, count in enumerate(arrays.joint_counts[: arrays.finger_count]):
        rotation, position = palm_rotations, palm_positions
        for j in range(count):
            position = position + rotation @ arrays.positions[finger, j]
            angles = joints[:, arrays.joint_indices[finger, j]]
            turn = Rotation.from_rotvec(np.outer(angles, (0, 0, 1))).as_matrix()
            rotation = rotation @ arrays.rotations[finger, j] @ turn  # (T, 3, 3)
            links[finger, j] = rotation, position
    rotations, positions = [], []
    carriers = zip(arrays.shape_fingers.tolist(), arrays.shape_links.tolist(), strict=True)
    for k, carrier in enumerate(islice(carriers, arrays.shape_count)):
        rotation, position = links[carrier]
        rotations.append(rotation @ arrays.shape_rotations[k])
        positions.append(position + rotation @ arrays.shape_positions[k])
    return np.stack(rotations, axis=1), np.stack(positions, axis=1)


def turn_z_to(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions xyzw (..., 4) of the shortest turns from the z axis to unit vectors (..., 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    quaternions = np.stack([-y, x, np.zeros_like(x), 1 + z], axis=-1)
    quaternions[z < -1 + 1e-9] = (1.0, 0.0, 0.0, 0.0)
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True))
