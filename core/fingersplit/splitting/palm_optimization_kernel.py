"""Algorithm 2 of [Fan2018]: palm pose optimization (PPO). The contacts stand still, palm and joints move.

As in the paper the object moves in the palm frame. In object coordinates about the centre of mass the contacts are
constant and eq. (6) reads v + omega x p_i = J_i q_dot_i, with the object's body velocity (v, omega) and p_i the centre
of finger i's pad on its contact (a ball joint there is the paper's rotational freedom of the contact).
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.splitting.acceptance_kernel import CONTINUE, REACHED_ITERATION_LIMIT, judge
from fingersplit.splitting.clock_kernel import seconds
from fingersplit.splitting.objective_kernel import manipulability_gradient
from fingersplit.splitting.palm_motion_kernel import halves, move_palm
from fingersplit.splitting.potential_kernel import add_penalty_gradient
from fingersplit.splitting.state_kernel import evaluate, pad_target
from fingersplit.splitting.trace_kernel import PPO, record
from fingersplit.splitting.tracking_kernel import STATIONARY, at_limit, track
from fingersplit.vectors_kernel import (
    add,
    cross,
    dot,
    get,
    put,
    scale,
    solve_positive_definite,
    subtract,
)

__all__ = ["optimize_palm", "palm_tangent_step"]


@kernel
def optimize_palm(problem, states, work, times, trace):
    """Climb the merit over palm pose and joints, the contacts fixed; arguments and results as ``optimize_contacts``."""
    settings, radius = problem.settings, problem.settings.ppo_trust_region
    for iteration in range(1, settings.max_inner_iterations + 1):
        started, measured = seconds(work.clock), times.collision
        palm_tangent_step(problem.hand, settings, problem.center, states[0], work, radius)  # line 3, eq. (7)
        searched = seconds(work.clock)
        _project(problem, states[0], states[1], work)  # lines 3 to 6, eq. (8) and (9)
        verdict = judge(problem, states[0], states[1], settings.ppo_least_increase, work, times)  # line 7
        times.search += searched - started
        times.projection += seconds(work.clock) - searched - (times.collision - measured)
        if verdict == CONTINUE:
            states[0] = states[1]  # line 9
            record(trace, PPO, states[0])
            radius = min(settings.trust_region_growth * radius, settings.ppo_trust_region)
        else:
            radius *= settings.trust_region_shrink
            if radius < settings.least_trust_region:  # line 8
                return verdict, iteration
    return REACHED_ITERATION_LIMIT, settings.max_inner_iterations


@kernel
def palm_tangent_step(hand, settings, center, state, work, radius):
    """Eq. (7): object velocity V_po^b into ``work.step.twist`` and driver velocities into ``work.step.driver_step``.

    The gradient (g_V, g) of the merit by the object's velocity and by the drivers, projected on the grasp constraint
    G^T V = J_h q_dot: with M = G^T G + J_h J_h^T and lambda = M^-1 (J_h g - G^T g_V), V = g_V + G lambda and
    q_dot = g - J_h^T lambda, scaled to |q_dot| = sigma_ppo, which is ``radius``. Without potentials g_V is zero and
    this is the paper's. A driver at its limit and pushed outwards leaves the active set.
    """
    manipulability_gradient(hand, state.drivers, work.step.driver_gradient)
    work.step.driver_gradient[:] *= settings.hand_weight
    work.step.twist_gradient[:] = 0.0
    add_penalty_gradient(hand, settings, state, center, work.step)
    work.solver.frozen[:] = False
    for _ in range(hand.driver_count + 1):
        _solve_grasp_constraint(hand, state, center, work)
        changed = False
        for j in range(hand.driver_count):
            if not work.solver.frozen[j] and at_limit(hand, state.drivers, j, work.step.driver_step[j]):
                work.solver.frozen[j], changed = True, True
        if not changed:
            break
    squared, steepest = 0.0, 0.0
    for j in range(hand.driver_count):
        squared += work.step.driver_step[j] ** 2
        steepest += work.step.driver_gradient[j] ** 2
    moves = squared > STATIONARY**2 * steepest
    alpha = radius / math.sqrt(squared) if moves else 0.0
    work.step.twist[:] *= alpha
    work.step.driver_step[:] *= alpha


@kernel
def _solve_grasp_constraint(hand, state, center, work):
    """Eq. (7) without its scaling, for the joints that are not frozen."""
    fingers, M, B = hand.finger_count, work.solver.matrix, work.solver.columns
    for a in range(fingers):
        p = subtract(pad_target(hand, state, a), center)
        for b in range(fingers):
            q = subtract(pad_target(hand, state, b), center)
            inner = dot(p, q)  # G_a^T G_b = (1 + p . q) I - q p^T
            for i in range(3):
                for k in range(3):
                    M[3 * a + i, 3 * b + k] = (1.0 + inner if i == k else 0.0) - q[i] * p[k]
    linear, angular = halves(work.step.twist_gradient)
    for a in range(fingers):
        J = state.jacobians[a]
        drift = add(linear, cross(angular, subtract(pad_target(hand, state, a), center)))  # G_a^T g_V
        for i in range(3):
            B[3 * a + i, 0] = -drift[i]
            B[3 * a + i, 1] = 0.0
            for c in range(hand.driver_counts[a]):
                j = hand.driver_indices[a, c]
                if not work.solver.frozen[j]:
                    B[3 * a + i, 0] += J[i, c] * work.step.driver_gradient[j]
                    for k in range(3):
                        M[3 * a + i, 3 * a + k] += J[i, c] * J[k, c]
    if hand.fingers_coupled:
        _couple_fingers(hand, state, work)
    solve_positive_definite(M, B, 3 * fingers)
    for j in range(hand.driver_count):
        work.step.driver_step[j] = 0.0 if work.solver.frozen[j] else work.step.driver_gradient[j]
    for a in range(fingers):
        multiplier = (B[3 * a, 0], B[3 * a + 1, 0], B[3 * a + 2, 0])
        linear = add(linear, multiplier)
        angular = add(angular, cross(subtract(pad_target(hand, state, a), center), multiplier))
        J = state.jacobians[a]
        for c in range(hand.driver_counts[a]):
            j = hand.driver_indices[a, c]
            if not work.solver.frozen[j]:
                work.step.driver_step[j] -= J[0, c] * multiplier[0] + J[1, c] * multiplier[1] + J[2, c] * multiplier[2]
    for k in range(3):
        work.step.twist[k], work.step.twist[3 + k] = linear[k], angular[k]


@kernel
def _couple_fingers(hand, state, work):
    """Add J_a J_b^T to M for every pair of fingers that share drivers."""
    M = work.solver.matrix
    for a in range(hand.finger_count):
        for b in range(hand.finger_count):
            for c in range(hand.driver_counts[a]):
                for d in range(hand.driver_counts[b]):
                    j = hand.driver_indices[a, c]
                    if a != b and j == hand.driver_indices[b, d] and not work.solver.frozen[j]:
                        for i in range(3):
                            for k in range(3):
                                M[3 * a + i, 3 * b + k] += state.jacobians[a, i, c] * state.jacobians[b, k, d]


@kernel
def _project(problem, state, candidate, work):
    """Lines 3 to 6: the palm takes its tangent step, the joints track the contacts that stay behind, eq. (9)."""
    hand, settings = problem.hand, problem.settings
    move_palm(work.step.twist, settings.time_step, problem.center, state, work.rotation, candidate)
    linear, angular = halves(work.step.twist)
    candidate.samples[:] = state.samples
    for finger in range(hand.finger_count):
        target = pad_target(hand, state, finger)
        velocity = add(linear, cross(angular, subtract(target, problem.center)))
        error = subtract(target, get(state.pads, finger))
        displacement = scale(settings.time_step, add(velocity, scale(settings.ppo_gain, error)))
        put(work.step.displacements, finger, displacement)
        put(candidate.contacts, finger, get(state.contacts, finger))
        put(candidate.normals, finger, get(state.normals, finger))
    track(hand, state, work.step.displacements, work.solver, candidate.drivers)
    move_drivers(hand, candidate)
    evaluate(hand, settings, candidate)
