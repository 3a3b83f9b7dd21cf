"""Potential fields: soft walls before the constraints, so that the search slides along them instead of stopping.

The future work of [Fan2018]. Each is a squared hinge that is zero while the constraint is far:

- w_d (d_margin - d_k)^2 for every link whose clearance d_k from the object is below the margin; links that carry a pad
  may touch, so theirs is zero,
- the same for the slack of every link from what stands around the object, links that carry a pad included,
- w_a (theta_f - theta_soft)^2 for every pad tilted more than a soft limit below the hard one,
- w_l (margin - distance)^2 for every driver near a limit, both as shares of its range.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, column, cross, dot, get, scale, subtract

__all__ = ["add_penalty_gradient", "penalty"]


@kernel
def penalty(hand, settings, state):
    """Sum of all potentials of an evaluated state, in the unit of Q."""
    total = 0.0
    if not settings.potentials:
        return total
    for shape in range(hand.shape_count):
        total += settings.clearance_weight * _clearance_hinge(hand, settings, state, shape) ** 2
    if state.around.least < settings.clearance_margin:
        for shape in range(hand.shape_count):
            total += settings.clearance_weight * _slack_hinge(settings, state, shape) ** 2
    for finger in range(hand.finger_count):
        soft = settings.soft_pad_angle * hand.pad_angle_scales[finger]
        total += settings.pad_angle_weight * max(state.pad_angles[finger] - soft, 0.0) ** 2
    for driver in range(hand.driver_count):
        total += settings.joint_limit_weight * _limit_hinge(hand, settings, state.drivers, driver) ** 2
    return total


@kernel
def add_penalty_gradient(hand, settings, state, center, step):
    """Subtract the gradient of ``penalty`` from ``step.driver_gradient`` and ``step.twist_gradient``.

    The twist is the object's body velocity about ``center``, linear then angular, as in PPO; contacts count as fixed.
    """
    if not settings.potentials:
        return
    for shape in range(hand.shape_count):
        hinge = _clearance_hinge(hand, settings, state, shape)
        if hinge > 0.0:
            slope = 2.0 * settings.clearance_weight * hinge  # of the merit by the clearance
            point, normal = get(state.clearance_points, shape), get(state.clearance_normals, shape)
            _push(hand, state, shape, point, scale(slope, normal), center, step)
    if state.around.least < settings.clearance_margin:
        for shape in range(hand.shape_count):
            hinge = _slack_hinge(settings, state, shape)
            if hinge > 0.0:
                away = scale(2.0 * settings.clearance_weight * hinge, get(state.around.normals, shape))
                _push(hand, state, shape, get(state.around.points, shape), away, center, step)
    for finger in range(hand.finger_count):
        hinge = state.pad_angles[finger] - settings.soft_pad_angle * hand.pad_angle_scales[finger]
        if hinge > 0.0:
            pad = get(state.pad_normals, finger)
            turn = cross(pad, get(state.normals, finger))  # the angle's derivative by a turn of the pad, times sine
            slope = -2.0 * settings.pad_angle_weight * hinge / max(math.sin(state.pad_angles[finger]), 1e-3)
            _add_to_twist(step, (0.0, 0.0, 0.0), scale(-slope, turn))
            for j in range(hand.joint_counts[finger]):
                axis = column(state.link_rotations[finger, j], 2)
                _add_to_drivers(hand, finger, j, slope * dot(axis, turn), step)
    for driver in range(hand.driver_count):
        hinge = _limit_hinge(hand, settings, state.drivers, driver)
        if hinge != 0.0:
            width = hand.driver_upper[driver] - hand.driver_lower[driver]
            step.driver_gradient[driver] -= 2.0 * settings.joint_limit_weight * hinge / width


@kernel
def _add_to_drivers(hand, finger, j, slope, step):
    """Add the slope of the merit by a finger's joint ``j`` to the drivers that it follows."""
    joint = hand.joint_indices[finger, j]
    if hand.uncoupled:
        step.driver_gradient[joint] += slope
        return
    for k in range(hand.driver_counts[finger]):
        a = hand.driver_indices[finger, k]
        step.driver_gradient[a] += hand.coupling[joint, a] * slope


@kernel
def _push(hand, state, shape, point, away, center, step):
    """Add the gradient of a link's clearance to the step: ``away`` is its slope times the direction to ``point``."""
    _add_to_twist(step, away, cross(subtract(point, center), away))
    finger = hand.shape_fingers[shape]
    if finger >= 0:
        for j in range(hand.shape_links[shape] + 1):
            axis = column(state.link_rotations[finger, j], 2)
            motion = cross(axis, subtract(point, get(state.link_positions[finger], j)))
            _add_to_drivers(hand, finger, j, -dot(away, motion), step)


@kernel
def _clearance_hinge(hand, settings, state, shape):
    """How much a link's clearance falls short of what it should be [m]."""
    finger = hand.shape_fingers[shape]
    touches = finger >= 0 and hand.shape_links[shape] == hand.joint_counts[finger] - 1
    return max((0.0 if touches else settings.clearance_margin) - state.clearances[shape], 0.0)


@kernel
def _slack_hinge(settings, state, shape):
    """How much a link's slack from what stands around falls short of what it should be [m]."""
    return max(settings.clearance_margin - state.around.slacks[shape], 0.0)


@kernel
def _limit_hinge(hand, settings, drivers, a):
    """How far a driver stands inside the margin of a limit, as a share of its range; negative at the lower one."""
    width = hand.driver_upper[a] - hand.driver_lower[a]
    margin = settings.joint_limit_margin * width
    above = drivers[a] - (hand.driver_upper[a] - margin)
    below = drivers[a] - (hand.driver_lower[a] + margin)
    return max(above, 0.0) / width if above > 0.0 else min(below, 0.0) / width


@kernel
def _add_to_twist(step, linear, angular):
    gradient = step.twist_gradient
    first = add((gradient[0], gradient[1], gradient[2]), linear)
    second = add((gradient[3], gradient[4], gradient[5]), angular)
    gradient[0], gradient[1], gradient[2] = first
    gradient[3], gradient[4], gradient[5] = second
