"""What a mask of violated constraints says, for people and for programs."""

from typing import NamedTuple

import numpy as np

from fingersplit.feasibility.violations_kernel import IN_COLLISION, JOINT_LIMIT, OFF_SURFACE, PAD_ANGLE
from fingersplit.hands.hand import Hand
from fingersplit.splitting.termination import Termination

__all__ = ["Violation", "describe_violations"]


class Violation(NamedTuple):
    """A violated constraint: how a run that ends with it ended, and a sentence with its value and its bound."""

    termination: Termination
    sentence: str


def describe_violations(mask: int, hand: Hand, settings: np.record, state: np.record) -> tuple[Violation, ...]:
    """Every constraint of a mask from ``find_violations``, contacts first.

    Args:
        mask: A bit for each violated constraint.
        hand: The hand.
        settings: ``SETTINGS`` record.
        state: ``STATE`` record of the grasp.
    """
    bits = (bit for bit in range(mask.bit_length()) if mask >> bit & 1)
    return tuple(_describe(bit, hand, settings, state) for bit in bits)


def _describe(bit: int, hand: Hand, settings: np.record, state: np.record) -> Violation:
    if bit < PAD_ANGLE:
        finger = bit - OFF_SURFACE
        return Violation(
            Termination.CONTACT_OFF_SURFACE,
            f"The pad of {hand.fingers[finger].name} is {1e3 * state.residuals[finger]:.1f} mm from touching the "
            f"surface; allowed: {1e3 * settings.contact_tolerance:g} mm.",
        )
    if bit < IN_COLLISION:
        finger = bit - PAD_ANGLE
        return Violation(
            Termination.PAD_ANGLE_VIOLATED,
            f"The pad of {hand.fingers[finger].name} is tilted {state.pad_angles[finger]:.2f} rad against the "
            f"surface; allowed: {settings.pad_angle_limit:g} rad.",
        )
    if bit == IN_COLLISION:
        return Violation(
            Termination.IN_COLLISION,
            f"A link lies {1e3 * state.penetration:.1f} mm inside the object; "
            f"allowed: {1e3 * settings.penetration_tolerance:g} mm.",
        )
    joint = bit - JOINT_LIMIT
    low, high = hand.lower[joint], hand.upper[joint]
    return Violation(
        Termination.JOINT_LIMIT_VIOLATED,
        f"{hand.joint_names[joint]} is at {state.joints[joint]:.3f} rad; allowed: {low:.3f} to {high:.3f} rad.",
    )
