"""Whether the palm may be at a place, and whether it may travel along a direction."""

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, dot, get, norm, rotate, subtract, vector

__all__ = ["direction_allowed", "palm_allowed"]

ROUNDING = 1e-9


@kernel
def palm_allowed(limits, position):
    """Whether the palm's origin may be at ``position`` (object frame) [m]."""
    place = add(rotate(limits.world_rotation, position), vector(limits.world_position))
    for axis in range(3):
        if not limits.lowest[axis] - ROUNDING <= place[axis] <= limits.highest[axis] + ROUNDING:
            return False
    away = norm(subtract(place, vector(limits.reach_center)))
    return limits.reach_least - ROUNDING <= away <= limits.reach_most + ROUNDING


@kernel
def direction_allowed(limits, direction):
    """Whether the hand may travel along a unit vector (object frame)."""
    for cone in range(limits.cone_count):
        if dot(get(limits.cone_axes, cone), direction) >= limits.cone_cosines[cone] - ROUNDING:
            return True
    return limits.cone_count == 0
