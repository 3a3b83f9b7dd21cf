"""Algorithm 1 of [Fan2018]: contact point optimization (CPO). The palm stands still, contacts and joints move."""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.objects.surface_kernel import closest
from fingersplit.splitting.acceptance_kernel import CONTINUE, REACHED_ITERATION_LIMIT, judge
from fingersplit.splitting.clock_kernel import seconds
from fingersplit.splitting.coupled_contacts_kernel import step_together
from fingersplit.splitting.objective_kernel import manipulability_gradient, object_quality_gradient
from fingersplit.splitting.potential_kernel import add_penalty_gradient
from fingersplit.splitting.state_kernel import attach_contacts, evaluate, measure_collision
from fingersplit.splitting.trace_kernel import CPO, record, record_contact_steps
from fingersplit.splitting.tracking_kernel import STATIONARY, at_limit, track
from fingersplit.vectors_kernel import add, get, put, scale, solve_positive_definite, subtract

__all__ = ["optimize_contacts", "tangent_step"]

LINE_SEARCH_HALVINGS = 4


@kernel
def optimize_contacts(problem, states, work, times, trace):
    """Climb the merit over contacts and joints until it stops rising or a constraint is met.

    At the paper's fidelity every step is as long as the trust region, and the first one that is refused ends the phase.
    The default lets the trust region grow with success and shrink with refusals, down to ``least_trust_region``.

    Args:
        problem: ``Problem``.
        states: Three ``STATE`` records: the first holds the last accepted state on return, the others are scratch.
        work: ``WORK`` record.
        times: ``PHASE_TIMES`` record, added to.
        trace: ``TraceRows``; every accepted state is recorded.

    Returns:
        Why it stopped (``acceptance``) and the number of tangent searches, the rejected ones included.
    """
    settings, radius = problem.settings, problem.settings.cpo_trust_region
    for iteration in range(1, settings.max_inner_iterations + 1):
        started, measured = seconds(work.clock), times.collision
        tangent_step(problem.hand, settings, problem.center, states[0], work, radius)  # line 3
        searched = seconds(work.clock)
        _project(problem, states[0], 1.0, states[1], work)  # lines 4 to 6
        if settings.line_search:
            _search_line(problem, states, work, times)
        verdict = judge(problem, states[0], states[1], settings.cpo_least_increase, work, times)  # line 7
        times.search += searched - started
        times.projection += seconds(work.clock) - searched - (times.collision - measured)
        if verdict == CONTINUE:
            states[0] = states[1]  # line 9
            record(trace, CPO, states[0])
            record_contact_steps(trace, work.step.contact_step)
            radius = min(settings.trust_region_growth * radius, settings.cpo_trust_region)
        else:
            radius *= settings.trust_region_shrink
            if radius < settings.least_trust_region:  # line 8
                return verdict, iteration
    return REACHED_ITERATION_LIMIT, settings.max_inner_iterations


@kernel
def tangent_step(hand, settings, center, state, work, radius):
    """Line 3: the step d* = alpha* d_0 of eq. (4) with alpha* = sigma_cpo / |d_0| into ``work.step.contact_step``.

    Eq. (4) projects the gradient (g_c, g_q) of Q on {d_c = J d_q, n^T d_c = 0}. The constraints couple no two fingers,
    so each one solves its own problem, exactly equal to (4):

        minimise |J d_q - g_c|^2 + |d_q - g_q|^2  subject to  n^T J d_q = 0.

    Fingers that share a driver are solved for together (``coupled_contacts_kernel``). A driver at its limit and pushed
    outwards leaves the active set and the problem is solved again. ``radius`` is
    sigma_cpo.
    """
    fingers = hand.finger_count
    object_quality_gradient(state.contacts, fingers, work.step.contact_gradient)
    manipulability_gradient(hand, state.drivers, work.step.driver_gradient)
    work.step.contact_gradient[:] *= settings.object_weight
    work.step.driver_gradient[:] *= settings.hand_weight
    add_penalty_gradient(hand, settings, state, center, work.step)
    squared, steepest = 0.0, 0.0
    if hand.fingers_coupled:
        step_together(hand, state, work)
    for finger in range(fingers):
        if not hand.fingers_coupled:
            _finger_step(hand, state, finger, work)
        for k in range(3):
            squared += work.step.contact_step[finger, k] ** 2
            steepest += work.step.contact_gradient[finger, k] ** 2
    for j in range(hand.driver_count):
        squared += work.step.driver_step[j] ** 2
        steepest += work.step.driver_gradient[j] ** 2
    moves = squared > STATIONARY**2 * steepest
    alpha = radius / math.sqrt(squared) if moves else 0.0
    for finger in range(fingers):
        for k in range(3):
            work.step.contact_step[finger, k] *= alpha
    for j in range(hand.driver_count):
        work.step.driver_step[j] *= alpha


@kernel
def _finger_step(hand, state, finger, work):
    """One finger's part of d_0: solves (J^T J + I) d_q = J^T g_c + g_q - lambda J^T n for d_q, lambda."""
    count, J, frozen = hand.driver_counts[finger], state.jacobians[finger], work.solver.frozen
    g, n = get(work.step.contact_gradient, finger), get(state.normals, finger)
    H, B = work.solver.matrix, work.solver.columns
    for i in range(count):
        frozen[i] = False
    for _ in range(count + 1):
        for i in range(count):
            for k in range(count):
                H[i, k] = 1.0 if i == k else 0.0
                if not (frozen[i] or frozen[k]):
                    H[i, k] += J[0, i] * J[0, k] + J[1, i] * J[1, k] + J[2, i] * J[2, k]
            B[i, 0], B[i, 1] = 0.0, 0.0
            if not frozen[i]:
                B[i, 0] = J[0, i] * g[0] + J[1, i] * g[1] + J[2, i] * g[2]
                B[i, 0] += work.step.driver_gradient[hand.driver_indices[finger, i]]
                B[i, 1] = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
        solve_positive_definite(H, B, count)
        along, across = 0.0, 0.0  # n^T J of both solutions
        for i in range(count):
            if not frozen[i]:
                slope = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
                along += slope * B[i, 0]
                across += slope * B[i, 1]
        multiplier = along / across if across > 0.0 else 0.0
        changed = False
        for i in range(count):
            j = hand.driver_indices[finger, i]
            work.step.driver_step[j] = B[i, 0] - multiplier * B[i, 1]
            if not frozen[i] and at_limit(hand, state.drivers, j, work.step.driver_step[j]):
                frozen[i], changed = True, True
        if not changed:
            break
    for k in range(3):
        work.step.contact_step[finger, k] = 0.0
        for i in range(count):
            work.step.contact_step[finger, k] += J[k, i] * work.step.driver_step[hand.driver_indices[finger, i]]


@kernel
def _project(problem, state, fraction, candidate, work):
    """Lines 4 to 6: from the tangent step, times ``fraction``, back to fingertips on the surface, in ``candidate``."""
    hand, settings = problem.hand, problem.settings
    gain = settings.cpo_gain * settings.time_step
    candidate.palm_rotation[:], candidate.palm_position[:] = state.palm_rotation, state.palm_position
    for finger in range(hand.finger_count):
        reached = add(get(state.contacts, finger), scale(fraction, get(work.step.contact_step, finger)))
        sample, reference, normal = closest(problem.surface, reached, state.samples[finger])
        candidate.samples[finger] = sample
        target = add(reference, scale(hand.pad_radii[finger], normal))
        put(work.step.displacements, finger, scale(gain, subtract(target, get(state.pads, finger))))
    track(hand, state, work.step.displacements, work.solver, candidate.drivers)
    move_drivers(hand, candidate)
    attach_contacts(problem.surface, hand, candidate)
    evaluate(hand, settings, candidate)


@kernel
def _search_line(problem, states, work, times):
    """F_ls = 1: the best of the full step, already in ``states[1]``, and its halvings."""
    fraction = 1.0
    if problem.settings.potentials:
        measure_collision(problem, states[1], work, times)
    for _ in range(LINE_SEARCH_HALVINGS):
        fraction *= 0.5
        _project(problem, states[0], fraction, states[2], work)
        if problem.settings.potentials:
            measure_collision(problem, states[2], work, times)
        if states[2].merit > states[1].merit:
            states[1] = states[2]
