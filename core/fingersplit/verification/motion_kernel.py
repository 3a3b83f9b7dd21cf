"""How an object moves in a hand, step by step of a simulation."""

import math

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, cross, dot, norm, scale, subtract, vector

__all__ = ["move_in_hand"]


@kernel
def move_in_hand(start, positions, wxyz, center_of_mass, distances, turns):
    """Write how far the centre of mass is from where it began, and how far the object has turned since.

    Args:
        start: Position and quaternion (w, x, y, z) of the object when it began, (7,).
        positions: Origin of the object frame at every step, (T, 3) [m].
        wxyz: Orientation of the object, unit quaternions, (T, 4).
        center_of_mass: In the object frame, (3,) [m].
        distances: Written, (T,) [m].
        turns: Written, (T,) [rad].
    """
    center = vector(center_of_mass)
    w0, v0 = start[3], (start[4], start[5], start[6])
    began = _transform((start[0], start[1], start[2]), w0, v0, center)
    for t in range(len(positions)):
        w, v = wxyz[t, 0], (wxyz[t, 1], wxyz[t, 2], wxyz[t, 3])
        distances[t] = norm(subtract(_transform(vector(positions[t]), w, v, center), began))
        # The turn since is the quaternion q0^-1 q.
        along = subtract(subtract(scale(w0, v), scale(w, v0)), cross(v0, v))
        turns[t] = 2.0 * math.atan2(norm(along), abs(w0 * w + dot(v0, v)))


@kernel
def _transform(position, w, v, point):
    """A point of the frame at ``position`` with the orientation (w, v)."""
    inner = add(cross(v, point), scale(w, point))
    return add(add(position, point), scale(2.0, cross(v, inner)))
