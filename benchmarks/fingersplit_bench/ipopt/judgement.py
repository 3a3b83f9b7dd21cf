"""Our own measure of a grasp that somebody else found: what `plan` would call feasible."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.feasibility.penetration_kernel import exact_penetration
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.surface_kernel import closest, touch
from fingersplit.splitting.objective_kernel import manipulability, object_quality
from fingersplit.splitting.settings import PlannerSettings

__all__ = ["Judgement", "judge_grasp"]


@dataclass(frozen=True)
class Judgement:
    """A posed hand, measured against the triangles.

    Attributes:
        quality: Q = w1 Q_o + w2 Q_h at the points that the pads touch.
        residual: Farthest that a pad is from just touching the surface [m].
        pad_angle: Largest angle of a pad's normal to the inward surface normal, or to where its cap touches [rad].
        penetration: Deepest that any link lies in the object [m].
        feasible: Whether all three keep the planner's tolerances; joint limits are kept by whoever found the joints.
    """

    quality: float
    residual: float
    pad_angle: float
    penetration: float
    feasible: bool


def judge_grasp(
    model: ObjectModel,
    hand: Hand,
    settings: PlannerSettings,
    object_from_palm: NDArray[np.float64],
    joints: NDArray[np.float64],
) -> Judgement:
    """Measure the grasp that a palm pose (4, 4) and joints (N,) [rad] make."""
    pose = hand.pose(joints, object_from_palm)
    fingers = len(hand.fingers)
    pads, pad_normals = pose.pads[:fingers], pose.pad_normals[:fingers]
    contacts = np.array([touch(model.surface, tuple(pad), -1)[1] for pad in pads])
    normals = np.array([closest(model.surface, tuple(contact), -1)[2] for contact in contacts])
    away = pads - contacts
    heights = np.copysign(np.linalg.norm(away, axis=1), np.einsum("ij,ij->i", away, normals))
    residual = float(np.abs(heights - [finger.pad_radius for finger in hand.fingers]).max())
    directions = np.stack([normals, away / heights[:, None]])  # of the smoothed surface, and of what is touched
    cosines = -np.einsum("kij,ij->ki", directions, pad_normals)
    pad_angle = float(np.arccos(np.clip(cosines, -1, 1)).max())
    penetration = float(exact_penetration(hand.arrays, pose, model.patches, model.distance, 0.0))
    quality = settings.object_weight * object_quality(contacts, fingers)
    quality += settings.hand_weight * manipulability(hand.arrays, joints)
    feasible = (
        residual <= settings.contact_tolerance
        and pad_angle <= settings.pad_angle_limit
        and penetration <= settings.penetration_tolerance
    )
    return Judgement(float(quality), residual, pad_angle, penetration, feasible)
