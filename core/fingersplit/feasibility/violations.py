"""What a mask of violated constraints says, for people and for programs."""

from typing import NamedTuple

import numpy as np

from fingersplit.feasibility.violations_kernel import (
    IN_COLLISION,
    JOINT_LIMIT,
    NEAR_OBSTACLE,
    NO_APPROACH,
    OFF_SURFACE,
    OUTSIDE_REGION,
    OUTSIDE_WORKSPACE,
    PAD_ANGLE,
    SELF_COLLISION,
)
from fingersplit.hands.hand import Hand
from fingersplit.scene.ways import BY_OBJECT, BY_WORKSPACE, NOT_ALLOWED
from fingersplit.splitting.termination import Termination

__all__ = ["Limits", "Violation", "blocker_name", "describe_violations"]


class Violation(NamedTuple):
    """A violated constraint: how a run that ends with it ended, and a sentence with its value and its bound."""

    termination: Termination
    sentence: str


class Limits(NamedTuple):
    """What a request allows a grasp, beside the planner's settings.

    Attributes:
        limits: ``LIMITS`` record.
        way: ``WAY`` record of the grasp.
        names: Names of obstacles by number.
    """

    limits: np.record
    way: np.record
    names: tuple[str, ...]


def describe_violations(
    mask: int, hand: Hand, settings: np.record, state: np.record, limits: Limits
) -> tuple[Violation, ...]:
    """Every constraint of a mask of violations, contacts first.

    Args:
        mask: A bit for each violated constraint.
        hand: The hand.
        settings: ``SETTINGS`` record.
        state: ``STATE`` record of the grasp.
        limits: What the request allows.
    """
    bits = (bit for bit in range(mask.bit_length()) if mask >> bit & 1)
    return tuple(
        _describe(bit, hand, settings, state)
        if bit < NEAR_OBSTACLE or bit == SELF_COLLISION
        else _describe_limit(bit, hand, state, limits)
        for bit in bits
    )


def blocker_name(blocked_by: int, names: tuple[str, ...]) -> str:
    """What ends a way (``scene.ways``), in words."""
    if blocked_by >= 0:
        return repr(names[blocked_by])
    words = {
        BY_OBJECT: "the object",
        BY_WORKSPACE: "the end of the workspace",
        NOT_ALLOWED: "the approach cones",
    }
    return words.get(blocked_by, "nothing")


def _describe_limit(bit: int, hand: Hand, state: np.record, limits: Limits) -> Violation:
    if bit == NEAR_OBSTACLE:
        slacks = state.around.slacks[: len(hand.shape_names)]
        shape = int(slacks.argmin())
        sentence = (
            f"{hand.shape_names[shape]} lacks {-1e3 * slacks[shape]:.1f} mm of its clearance from "
            f"{limits.names[state.around.obstacles[shape]]!r}; allowed: 0 mm."
        )
        return Violation(Termination.NEAR_OBSTACLE, sentence)
    if bit == OUTSIDE_WORKSPACE:
        return Violation(
            Termination.OUTSIDE_WORKSPACE, "The palm is not where it may be; allowed: workspace and reach."
        )
    if bit == OUTSIDE_REGION:
        return Violation(Termination.OUTSIDE_REGION, "A contact lies where none may be; allowed: contact_regions.")
    way = limits.way
    if bit == NO_APPROACH and way.blocked_by == NOT_ALLOWED:
        sentence = "No direction of travel near the palm's axis is allowed: all lie outside the approach cones."
        return Violation(Termination.NO_FREE_APPROACH, sentence)
    approaches = bit == NO_APPROACH
    distance, blocked_by = (
        (way.distance, way.blocked_by) if approaches else (way.retreat_distance, way.retreat_blocked_by)
    )
    least = limits.limits.min_distance if approaches else limits.limits.retreat_min_distance
    sentence = (
        f"The straight way {'in' if approaches else 'out'} is free over {1e3 * distance:.0f} mm, until "
        f"{blocker_name(int(blocked_by), limits.names)}; allowed: from {1e3 * least:.0f} mm."
    )
    return Violation(Termination.NO_FREE_APPROACH if approaches else Termination.NO_FREE_RETREAT, sentence)


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
            f"surface; allowed: {settings.pad_angle_limit * hand.arrays.pad_angle_scales[finger]:g} rad.",
        )
    if bit == IN_COLLISION:
        return Violation(
            Termination.IN_COLLISION,
            f"A link lies {1e3 * state.penetration:.1f} mm inside the object; "
            f"allowed: {1e3 * settings.penetration_tolerance:g} mm.",
        )
    if bit == SELF_COLLISION:
        return Violation(
            Termination.IN_SELF_COLLISION,
            f"Two links of the hand lie {-1e3 * state.self_clearance:.1f} mm inside each other; "
            f"allowed: {1e3 * settings.penetration_tolerance:g} mm.",
        )
    joint = bit - JOINT_LIMIT
    low, high = hand.lower[joint], hand.upper[joint]
    return Violation(
        Termination.JOINT_LIMIT_VIOLATED,
        f"{hand.joint_names[joint]} is at {state.joints[joint]:.3f} rad; allowed: {low:.3f} to {high:.3f} rad.",
    )
