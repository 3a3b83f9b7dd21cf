"""Eq. (8) of [Fan2018]: the palm after a motion of the object in its frame."""

import math

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import (
    add,
    cross,
    multiply,
    norm,
    rotate,
    scale,
    set_rotation_about,
    subtract,
    vector,
)

__all__ = ["halves", "move_palm"]


@kernel
def halves(twist):
    """Linear and angular part of a (6,) array as vectors."""
    return (twist[0], twist[1], twist[2]), (twist[3], twist[4], twist[5])


@kernel
def move_palm(twist, duration, center, old, rotation, new):
    """Eq. (8), g_po exp(V duration), as seen from the object: palm pose exp(-V duration) g_op.

    Args:
        twist: Object body velocity about ``center``, linear then angular, (6,) [m/s, rad/s].
        duration: Time [s].
        center: Origin of the twist in the object frame [m].
        old: Record with the palm before.
        rotation: Scratch, (3, 3).
        new: Record that gets the palm after.
    """
    linear, angular = halves(twist)
    shift, turn = scale(-duration, linear), scale(-duration, angular)
    angle = norm(turn)
    axis = scale(1.0 / angle, turn) if angle > 1e-12 else (0.0, 0.0, 1.0)
    if angle > 1e-12:
        across = cross(axis, shift)
        bend = scale((1.0 - math.cos(angle)) / angle, across)
        shift = add(shift, add(bend, scale((angle - math.sin(angle)) / angle, cross(axis, across))))
    set_rotation_about(axis, angle, rotation)
    multiply(rotation, old.palm_rotation, new.palm_rotation)
    arm = subtract(vector(old.palm_position), center)
    position = add(add(center, rotate(rotation, arm)), shift)
    new.palm_position[0], new.palm_position[1], new.palm_position[2] = position
