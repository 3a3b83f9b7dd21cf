"""Which constraints a grasp violates: the one place that decides it, as a mask with a bit for each."""

from fingersplit.compilation import kernel
from fingersplit.hands.limits import MAX_FINGERS, MAX_JOINTS

__all__ = ["IN_COLLISION", "JOINT_LIMIT", "OFF_SURFACE", "PAD_ANGLE", "find_violations"]

OFF_SURFACE = 0
"""First bit of the pads that do not touch, one a finger."""
PAD_ANGLE = OFF_SURFACE + MAX_FINGERS
"""First bit of the pads that are tilted too far, one a finger."""
IN_COLLISION = PAD_ANGLE + MAX_FINGERS
"""Bit of links too deep in the object."""
JOINT_LIMIT = IN_COLLISION + 1
"""First bit of the joints outside their range, one a joint."""

assert JOINT_LIMIT + MAX_JOINTS < 63


@kernel
def find_violations(hand, settings, state):
    """Mask of the constraints that a measured ``state`` violates; 0 for a feasible grasp."""
    mask = 0
    for finger in range(hand.finger_count):
        if not state.residuals[finger] <= settings.contact_tolerance:
            mask |= 1 << (OFF_SURFACE + finger)
        if not state.pad_angles[finger] <= settings.pad_angle_limit:
            mask |= 1 << (PAD_ANGLE + finger)
    if not state.penetration <= settings.penetration_tolerance:
        mask |= 1 << IN_COLLISION
    for joint in range(hand.joint_count):
        if not hand.lower[joint] <= state.joints[joint] <= hand.upper[joint]:
            mask |= 1 << (JOINT_LIMIT + joint)
    return mask
