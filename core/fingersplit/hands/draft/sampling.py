"""Random postures of a hand, and where its links then are: what every proposal of a draft is measured on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.forward import joint_frame
from fingersplit.hands.model import HandModel

__all__ = ["Samples", "batched_link_poses", "sample_postures"]

Array = NDArray[np.float64]

END_SHARE = 0.15
"""Share of drivers that stand at one of their ends: grasps of thin and of wide objects are there."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Postures of a hand.

    Attributes:
        drivers: Driver angles, (n, A) [rad].
        poses: ``palm_from_link`` of every link, (n, L, 4, 4).
    """

    drivers: Array
    poses: Array


def sample_postures(model: HandModel, count: int, rng: np.random.Generator) -> Samples:
    """Driver angles drawn evenly between their limits, some at the limits themselves."""
    lower, upper = model.coupling.lower, model.coupling.upper
    shares = rng.uniform(size=(count, len(lower)))
    ends = rng.uniform(size=shares.shape)
    shares = np.where(ends < END_SHARE / 2, 0.0, np.where(ends > 1 - END_SHARE / 2, 1.0, shares))
    drivers = lower + shares * (upper - lower)
    return Samples(drivers, batched_link_poses(model, model.joints_from_drivers(drivers)))


def batched_link_poses(model: HandModel, joints: Array) -> Array:
    """``palm_from_link`` of every link at joint angles (n, N) [rad], (n, L, 4, 4)."""
    poses = np.empty((len(joints), len(model.links), 4, 4))
    for i, link in enumerate(model.links):
        poses[:, i] = link.pose if link.parent < 0 else poses[:, link.parent] @ link.pose
        for j in link.joints:
            body_from_joint = joint_frame(model.joints[j])
            angles = joints[:, j] - model.joints[j].reference
            turns = np.zeros((len(joints), 4, 4))
            turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
            turns[:, 1, 0] = np.sin(angles)
            turns[:, 0, 1] = -turns[:, 1, 0]
            turns[:, 2, 2] = turns[:, 3, 3] = 1.0
            poses[:, i] = poses[:, i] @ (body_from_joint @ turns @ np.linalg.inv(body_from_joint))
    return poses
