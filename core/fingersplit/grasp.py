"""A posed hand, and a grasp: the posed hand with its contacts on the object."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.transforms import wxyz_from_rotation

__all__ = ["Grasp", "HandPose"]


@dataclass(frozen=True, eq=False)
class HandPose:
    """Where a hand is.

    Attributes:
        object_from_palm: Palm pose in the object frame, (4, 4).
        joints: Joint angles in the hand's order, (N,) [rad].
    """

    object_from_palm: NDArray[np.float64]
    joints: NDArray[np.float64]

    @property
    def position(self) -> NDArray[np.float64]:
        """Palm origin in the object frame, (3,) [m]."""
        return self.object_from_palm[:3, 3]

    @property
    def wxyz(self) -> NDArray[np.float64]:
        """Rotation from the palm frame to the object frame, unit quaternion, (4,)."""
        return wxyz_from_rotation(self.object_from_palm[:3, :3])

    @property
    def qpos(self) -> NDArray[np.float64]:
        """Position xyz [m], quaternion wxyz, then joints [rad], (7 + N,)."""
        return np.concatenate([self.position, self.wxyz, self.joints])


@dataclass(frozen=True, eq=False)
class Grasp(HandPose):
    """A posed hand and where its fingers touch.

    Attributes:
        contacts: Contact points on the object, (F, 3) [m].
        normals: Outward surface normals at the contacts, (F, 3).
        fingertips: Points of the pads that face the contacts, (F, 3) [m].
        residuals: How far each pad is from just touching its contact, (F,) [m].
        pad_angles: Angle between pad normal and inward surface normal, (F,) [rad].
    """

    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    fingertips: NDArray[np.float64]
    residuals: NDArray[np.float64]
    pad_angles: NDArray[np.float64]
