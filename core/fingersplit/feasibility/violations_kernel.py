"""Which constraints a grasp violates: the one place that decides it, as a mask with a bit for each."""

from fingersplit.compilation import kernel
from fingersplit.hands.limits import MAX_FINGERS, MAX_JOINTS
from fingersplit.scene.limits_kernel import palm_allowed
from fingersplit.vectors_kernel import vector

__all__ = [
    "IN_COLLISION",
    "JOINT_LIMIT",
    "NEAR_OBSTACLE",
    "NO_APPROACH",
    "NO_RETREAT",
    "OFF_SURFACE",
    "OUTSIDE_REGION",
    "OUTSIDE_WORKSPACE",
    "PAD_ANGLE",
    "SELF_COLLISION",
    "SLACK_TOLERANCE",
    "find_violations",
]

OFF_SURFACE = 0
"""First bit of the pads that do not touch, one a finger."""
PAD_ANGLE = OFF_SURFACE + MAX_FINGERS
"""First bit of the pads that are tilted too far, one a finger."""
IN_COLLISION = PAD_ANGLE + MAX_FINGERS
"""Bit of links too deep in the object."""
JOINT_LIMIT = IN_COLLISION + 1
"""First bit of the joints outside their range, one a joint."""
NEAR_OBSTACLE = JOINT_LIMIT + MAX_JOINTS
"""Bit of links too near to what stands around the object."""
OUTSIDE_WORKSPACE = NEAR_OBSTACLE + 1
"""Bit of a palm where it may not be."""
OUTSIDE_REGION = OUTSIDE_WORKSPACE + 1
"""Bit of contacts where they may not be."""
NO_APPROACH = OUTSIDE_REGION + 1
"""Bit of a grasp without a free straight approach, where one is required."""
NO_RETREAT = NO_APPROACH + 1
"""Bit of a grasp that obstacles keep from being retreated with."""
SELF_COLLISION = NO_RETREAT + 1
"""Bit of links too deep in each other."""

SLACK_TOLERANCE = 1e-5
"""[m]; less clearance than this short is rounding."""

assert SELF_COLLISION < 63


@kernel
def find_violations(hand, settings, limits, state):
    """Mask of the constraints that a measured ``state`` violates.

    It says nothing of contact regions, which are exact only in ``planning.final_checks``, and of ways in and out.
    """
    mask = 0
    for finger in range(hand.finger_count):
        if not state.residuals[finger] <= settings.contact_tolerance:
            mask |= 1 << (OFF_SURFACE + finger)
        if not state.pad_angles[finger] <= settings.pad_angle_limit * hand.pad_angle_scales[finger]:
            mask |= 1 << (PAD_ANGLE + finger)
    if not state.penetration <= settings.penetration_tolerance:
        mask |= 1 << IN_COLLISION
    for joint in range(hand.joint_count):
        if not hand.lower[joint] <= state.joints[joint] <= hand.upper[joint]:
            mask |= 1 << (JOINT_LIMIT + joint)
    if not state.self_clearance >= -settings.penetration_tolerance:
        mask |= 1 << SELF_COLLISION
    if not state.around.least >= -SLACK_TOLERANCE:
        mask |= 1 << NEAR_OBSTACLE
    if not palm_allowed(limits, vector(state.palm_position)):
        mask |= 1 << OUTSIDE_WORKSPACE
    return mask
