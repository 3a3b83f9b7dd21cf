"""Algorithm 2 of [Fan2018]: palm pose optimization (PPO). The contacts stand still, palm and joints move.

As in the paper the object moves in the palm frame. In object coordinates about the centre of mass the contacts are
constant and eq. (6) reads v + omega x p_i = J_i q_dot_i, with the object's body velocity (v, omega) and p_i the centre
of finger i's pad on its contact (a ball joint there is the paper's rotational freedom of the contact).
"""

import math

from fingersplit.compilation import kernel
from fingersplit.quality.objective import manipulability_gradient
from fingersplit.splitting.acceptance import CONTINUE, REACHED_ITERATION_LIMIT, judge, judge_collision
from fingersplit.splitting.clock import seconds
from fingersplit.splitting.state import copy_state, evaluate, pad_target, place_hand
from fingersplit.splitting.trace import PPO, record
from fingersplit.splitting.tracking import STATIONARY, at_limit, track
from fingersplit.vectors import (
    add,
    cross,
    dot,
    get,
    multiply,
    norm,
    rotate,
    scale,
    set_rotation_about,
    solve_positive_definite,
    subtract,
)

__all__ = ["move_palm", "optimize_palm", "palm_tangent_step"]


@kernel
def optimize_palm(problem, state, candidate, work, trace):
    """Climb Q over palm pose and joints with the contacts fixed; arguments and results as ``optimize_contacts``."""
    settings = problem.settings
    for iteration in range(1, settings.max_inner_iterations + 1):
        started = seconds(work.clock)
        palm_tangent_step(problem.hand, settings, problem.center, state, work)  # line 3, eq. (7)
        searched = seconds(work.clock)
        _project(problem, state, candidate, work)  # lines 3 to 6, eq. (8) and (9)
        verdict = judge(settings, state, candidate, settings.ppo_least_increase)  # line 7
        projected = seconds(work.clock)
        if verdict == CONTINUE:
            verdict = judge_collision(problem, state, candidate)
        ended = seconds(work.clock)
        work.times[3] += searched - started
        work.times[4] += projected - searched
        work.times[5] += ended - projected
        if verdict != CONTINUE:  # line 8
            return verdict, iteration
        copy_state(state, candidate)  # line 9
        record(trace, PPO, state)
    return REACHED_ITERATION_LIMIT, settings.max_inner_iterations


@kernel
def palm_tangent_step(hand, settings, center, state, work):
    """Eq. (7): object velocity V_po^b into ``work.twist`` and joint velocities into ``work.joint_step``.

    V = G (G^T G + J_h J_h^T)^-1 J_h g and q_dot = g - J_h^T (G^T G + J_h J_h^T)^-1 J_h g, with g the gradient of Q by
    the joints, scaled to |q_dot| = sigma_ppo. A joint at its limit and pushed outwards leaves the active set.
    """
    manipulability_gradient(hand, state.pose.joints, work.joint_gradient)
    work.joint_gradient[:] *= settings.hand_weight
    work.frozen[:] = False
    for _ in range(hand.lower.size + 1):
        _solve_grasp_constraint(hand, state, center, work)
        changed = False
        for j in range(hand.lower.size):
            if not work.frozen[j] and at_limit(hand, state.pose.joints, j, work.joint_step[j]):
                work.frozen[j], changed = True, True
        if not changed:
            break
    squared, steepest = 0.0, 0.0
    for j in range(hand.lower.size):
        squared += work.joint_step[j] ** 2
        steepest += work.joint_gradient[j] ** 2
    moves = squared > STATIONARY**2 * steepest
    alpha = settings.ppo_trust_region / math.sqrt(squared) if moves else 0.0
    work.twist[:] *= alpha
    work.joint_step[:] *= alpha


@kernel
def _solve_grasp_constraint(hand, state, center, work):
    """Eq. (7) without its scaling, for the joints that are not frozen."""
    fingers, M, B = len(state.contacts), work.matrix, work.columns
    for a in range(fingers):
        p = subtract(pad_target(hand, state, a), center)
        for b in range(fingers):
            q = subtract(pad_target(hand, state, b), center)
            inner = dot(p, q)  # G_a^T G_b = (1 + p . q) I - q p^T
            for i in range(3):
                for k in range(3):
                    M[3 * a + i, 3 * b + k] = (1.0 + inner if i == k else 0.0) - q[i] * p[k]
    for a in range(fingers):
        J = state.pose.jacobians[a]
        for i in range(3):
            B[3 * a + i, 0] = 0.0
            B[3 * a + i, 1] = 0.0
            for c in range(hand.joint_counts[a]):
                j = hand.joint_indices[a, c]
                if not work.frozen[j]:
                    B[3 * a + i, 0] += J[i, c] * work.joint_gradient[j]
                    for k in range(3):
                        M[3 * a + i, 3 * a + k] += J[i, c] * J[k, c]
    solve_positive_definite(M, B, 3 * fingers)
    work.twist[:] = 0.0
    for a in range(fingers):
        multiplier = (B[3 * a, 0], B[3 * a + 1, 0], B[3 * a + 2, 0])
        torque = cross(subtract(pad_target(hand, state, a), center), multiplier)
        for k in range(3):
            work.twist[k] += multiplier[k]
            work.twist[3 + k] += torque[k]
        J = state.pose.jacobians[a]
        for c in range(hand.joint_counts[a]):
            j = hand.joint_indices[a, c]
            work.joint_step[j] = 0.0
            if not work.frozen[j]:
                pull = J[0, c] * multiplier[0] + J[1, c] * multiplier[1] + J[2, c] * multiplier[2]
                work.joint_step[j] = work.joint_gradient[j] - pull


@kernel
def move_palm(twist, duration, center, old, rotations, new):
    """Eq. (8), g_po exp(V duration), as seen from the object: palm pose exp(-V duration) g_op.

    Args:
        twist: Object body velocity about ``center``, linear then angular, (6,) [m/s, rad/s].
        duration: Time [s].
        center: Origin of the twist in the object frame [m].
        old: ``HandPose`` with the palm before.
        rotations: Scratch, (2, 3, 3).
        new: ``HandPose`` that gets the palm after.
    """
    shift = (-duration * twist[0], -duration * twist[1], -duration * twist[2])
    turn = (-duration * twist[3], -duration * twist[4], -duration * twist[5])
    angle = norm(turn)
    if angle > 1e-12:
        axis = scale(1.0 / angle, turn)
        across = cross(axis, shift)
        shift = add(
            shift,
            add(
                scale((1.0 - math.cos(angle)) / angle, across),
                scale((angle - math.sin(angle)) / angle, cross(axis, across)),
            ),
        )
        set_rotation_about(axis, angle, rotations[0])
    else:
        set_rotation_about((0.0, 0.0, 1.0), 0.0, rotations[0])
    multiply(rotations[0], old.palm_rotation, new.palm_rotation)
    arm = subtract((old.palm_position[0], old.palm_position[1], old.palm_position[2]), center)
    moved = add(add(center, rotate(rotations[0], arm)), shift)
    new.palm_position[0], new.palm_position[1], new.palm_position[2] = moved


@kernel
def _project(problem, state, candidate, work):
    """Lines 3 to 6: the palm takes its tangent step, the joints track the contacts that stay behind, eq. (9)."""
    hand, settings = problem.hand, problem.settings
    copy_state(candidate, state)
    move_palm(work.twist, settings.time_step, problem.center, state.pose, work.rotations, candidate.pose)
    linear, angular = (work.twist[0], work.twist[1], work.twist[2]), (work.twist[3], work.twist[4], work.twist[5])
    for finger in range(len(state.contacts)):
        target = pad_target(hand, state, finger)
        velocity = add(linear, cross(angular, subtract(target, problem.center)))
        error = subtract(target, get(state.pose.pads, finger))
        displacement = scale(settings.time_step, add(velocity, scale(settings.ppo_gain, error)))
        track(hand, state.pose, finger, displacement, work, candidate.pose.joints)
    place_hand(problem, candidate, work)
    evaluate(problem, candidate)
