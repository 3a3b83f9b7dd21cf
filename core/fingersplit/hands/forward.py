"""Where a model's links stand, in NumPy: for what is done once a hand, such as parked fingers and pictures."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.hands.model import HandModel, Joint
from fingersplit.transforms import pose_matrix, rotation_to_axis

__all__ = ["joint_frame", "link_poses", "turn_about_z"]

Array = NDArray[np.float64]


def link_poses(model: HandModel, joints: ArrayLike) -> Array:
    """``palm_from_link`` of every link at joint angles (N,) [rad], (L, 4, 4)."""
    angles, poses = np.asarray(joints, dtype=np.float64), np.empty((len(model.links), 4, 4))
    for i, link in enumerate(model.links):
        poses[i] = link.pose if link.parent < 0 else poses[link.parent] @ link.pose
        for j in link.joints:
            body_from_joint = joint_frame(model.joints[j])
            turn = turn_about_z(float(angles[j]) - model.joints[j].reference)
            poses[i] = poses[i] @ body_from_joint @ turn @ np.linalg.inv(body_from_joint)
    return poses


def joint_frame(joint: Joint) -> Array:
    """``link_from_joint``: a frame at the joint's anchor whose z axis is the joint's, (4, 4)."""
    return pose_matrix(rotation_to_axis(joint.axis), joint.anchor)


def turn_about_z(angle: float) -> Array:
    """Pose (4, 4) that turns about z by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return pose_matrix([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], np.zeros(3))
