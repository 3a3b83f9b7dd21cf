"""Where a model's links stand, in NumPy: for what is done once a hand, such as parked fingers and pictures."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.hands.model import HandModel, Joint
from fingersplit.transforms import pose_matrix, rotation_to_axis

__all__ = ["joint_frame", "link_poses", "turn_about_z"]

Array = NDArray[np.float64]


def link_poses(model: HandModel, joints: ArrayLike) -> Array:
    """``palm_from_link`` of every link at joint angles (..., N) [rad], (..., L, 4, 4)."""
    angles = np.asarray(joints, dtype=np.float64)
    poses = np.empty((*angles.shape[:-1], len(model.links), 4, 4))
    for i, link in enumerate(model.links):
        poses[..., i, :, :] = link.pose if link.parent < 0 else poses[..., link.parent, :, :] @ link.pose
        for j in link.joints:
            body_from_joint = joint_frame(model.joints[j])
            turns = turn_about_z(angles[..., j] - model.joints[j].reference)
            poses[..., i, :, :] = poses[..., i, :, :] @ body_from_joint @ turns @ np.linalg.inv(body_from_joint)
    return poses


@lru_cache(maxsize=1024)
def joint_frame(joint: Joint) -> Array:
    """``link_from_joint``: a frame at the joint's anchor whose z axis is the joint's, (4, 4)."""
    frame = pose_matrix(rotation_to_axis(joint.axis), joint.anchor)
    frame.setflags(write=False)
    return frame


def turn_about_z(angles: ArrayLike) -> Array:
    """Poses (..., 4, 4) that turn about z by angles (...) [rad]."""
    turns = np.zeros((*np.shape(angles), 4, 4))
    turns[..., 0, 0] = turns[..., 1, 1] = np.cos(angles)
    turns[..., 1, 0] = np.sin(angles)
    turns[..., 0, 1] = -turns[..., 1, 0]
    turns[..., 2, 2] = turns[..., 3, 3] = 1.0
    return turns
