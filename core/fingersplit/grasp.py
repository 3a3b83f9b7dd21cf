"""What a grasp is: palm pose, joints and contacts in the object frame."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.transforms import wxyz_from_rotation

__all__ = ["Grasp", "palm_document"]


@dataclass(frozen=True, eq=False)
class Grasp:
    """A posed hand and where its fingers touch.

    Attributes:
        object_from_palm: Palm pose in the object frame, (4, 4).
        joints: Joint angles in the hand's order, (N,) [rad].
        contacts: Contact points on the object, (F, 3) [m].
        normals: Outward surface normals at the contacts, (F, 3).
        fingertips: Points of the pads that face the contacts, (F, 3) [m].
        residuals: How far each pad is from just touching its contact, (F,) [m].
        pad_angles: Angle between pad normal and inward surface normal, (F,) [rad].
    """

    object_from_palm: NDArray[np.float64]
    joints: NDArray[np.float64]
    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    fingertips: NDArray[np.float64]
    residuals: NDArray[np.float64]
    pad_angles: NDArray[np.float64]

    def to_document(self, hand: Hand, forces: NDArray[np.float64] | None = None) -> dict[str, Any]:
        """Palm, named joints and contacts as plain JSON data; ``forces`` (F, 3) [N] go with the contacts."""
        return {
            "palm": palm_document(self.object_from_palm),
            "joints": hand.named(self.joints),
            "contacts": [
                {
                    "finger": finger.name,
                    "position": self.contacts[f].tolist(),
                    "normal": self.normals[f].tolist(),
                    "fingertip": self.fingertips[f].tolist(),
                    "residual": float(self.residuals[f]),
                    "pad_angle": float(self.pad_angles[f]),
                    "force": None if forces is None else forces[f].tolist(),
                }
                for f, finger in enumerate(hand.fingers)
            ],
        }


def palm_document(object_from_palm: NDArray[np.float64]) -> dict[str, Any]:
    """A palm pose (4, 4) as plain JSON data."""
    return {
        "position": object_from_palm[:3, 3].tolist(),
        "wxyz": wxyz_from_rotation(object_from_palm[:3, :3]).tolist(),
    }
