"""Approaches of parallel grasps that come from where the palm has room."""

import math

from fingersplit.compilation import kernel
from fingersplit.objects.grid_kernel import nearest
from fingersplit.scene.limits_kernel import direction_allowed, palm_allowed
from fingersplit.scene.obstacles_kernel import point_slack
from fingersplit.vectors_kernel import add, cross, dot, get, norm, scale, subtract

__all__ = ["rate_approaches"]

LOOKED_AT = 0.04
"""[m]; more room than this is as good as any."""


@kernel
def rate_approaches(scene, limits, grid, contacts, standoff, thickness, beyond, ratings, directions):
    """Rate evenly turned approaches of every pair of contacts.

    Args:
        scene: ``SceneArrays`` or None.
        limits: ``LIMITS`` record.
        grid: The object's surface samples.
        contacts: Pairs (n, 2, 3) [m].
        standoff: How far the palm's origin is behind the middle of the contacts [m].
        thickness: Of a finger beside its contact [m].
        beyond: How far outside its cone a direction may be, since the hand may travel beside its axis [rad].
        ratings: Gets, for each approach, minus infinity where it cannot be, else room of the palm [m], at most
            ``LOOKED_AT``, less what it leaves the cones, (n, m).
        directions: Gets the approaches, (n, m, 3).
    """
    turns = ratings.shape[1]
    for i in range(len(contacts)):
        first, second = get(contacts[i], 0), get(contacts[i], 1)
        jaw = subtract(first, second)
        jaw = scale(1.0 / norm(jaw), jaw)
        side = _across(jaw)
        other = cross(jaw, side)
        possible = _contacts_possible(scene, grid, first, second, scale(thickness, jaw))
        middle = scale(0.5, add(first, second))
        for a in range(turns):
            angle = 2.0 * math.pi * a / turns
            direction = add(scale(math.cos(angle), side), scale(math.sin(angle), other))
            directions[i, a, 0], directions[i, a, 1], directions[i, a, 2] = direction
            palm = subtract(middle, scale(standoff, direction))
            ratings[i, a] = -math.inf
            excess = _outside_cones(limits, direction)
            if possible and excess <= beyond and palm_allowed(limits, palm):
                room = LOOKED_AT if scene is None else _room(scene, palm)
                if room >= 0.0:
                    ratings[i, a] = room - excess


@kernel
def _room(scene, palm):
    return 0.0 if scene is None else point_slack(scene, palm, LOOKED_AT)


@kernel
def _contacts_possible(scene, grid, first, second, outwards):
    """Whether fingers have room beside both contacts, and these lie where contacts may be."""
    if scene is None:
        return True
    room = min(point_slack(scene, add(first, outwards), 0.0), point_slack(scene, subtract(second, outwards), 0.0))
    if room < 0.0:
        return False
    return scene.admitted[nearest(grid, first, -1)] and scene.admitted[nearest(grid, second, -1)]


@kernel
def _outside_cones(limits, direction):
    """Angle from a direction to the nearest allowed one [rad]."""
    if direction_allowed(limits, direction):
        return 0.0
    least = math.inf
    for cone in range(limits.cone_count):
        angle = math.acos(min(max(dot(get(limits.cone_axes, cone), direction), -1.0), 1.0))
        least = min(least, angle - math.acos(min(max(limits.cone_cosines[cone], -1.0), 1.0)))
    return least


@kernel
def _across(v):
    """A unit vector at right angles to a unit vector."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    axis = (1.0, 0.0, 0.0) if x <= y and x <= z else (0.0, 1.0, 0.0) if y <= z else (0.0, 0.0, 1.0)
    side = cross(v, axis)
    return scale(1.0 / norm(side), side)
