"""PPO with sliding contacts: palm and drivers move together, and only the pads' motion along the normals is held.

A departure from [Fan2018] for hands with few drivers, see REFERENCES.md: with A drivers and F fingers eq. (6) leaves
6 + A - 3 F freedoms, which is none for a driver a finger; holding the normal components alone leaves 6 + A - F. The
contacts follow the pads along the surface, so Q_o counts, too.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.splitting.acceptance_kernel import CONTINUE, REACHED_ITERATION_LIMIT, judge
from fingersplit.splitting.clock_kernel import seconds
from fingersplit.splitting.objective_kernel import manipulability_gradient, object_quality_gradient
from fingersplit.splitting.palm_motion_kernel import move_palm
from fingersplit.splitting.potential_kernel import add_penalty_gradient
from fingersplit.splitting.pull_kernel import LENGTH, pull_pads, set_row, take_pose
from fingersplit.splitting.state_kernel import attach_contacts, evaluate
from fingersplit.splitting.trace_kernel import PPO, record
from fingersplit.splitting.tracking_kernel import STATIONARY, TOGETHER, at_limit
from fingersplit.vectors_kernel import get, solve_positive_definite

__all__ = ["slide_palm", "slides", "sliding_step"]

ALWAYS, FEW_DRIVERS = 2, 1
"""Values of the setting ``palm_sliding``."""
CORRECTIONS = 2
"""Steps that bring pads back to the surface after they slid."""
CORRECTION_DAMPING = 1e-3
"""[m/rad]."""
NOWHERE = (0.0, 0.0, 0.0)


@kernel
def slides(hand, settings):
    """Whether contacts slide while the palm moves: where the hand has fewer than two drivers a finger, or always."""
    few = hand.driver_count < 2 * hand.finger_count
    return settings.palm_sliding == ALWAYS or (settings.palm_sliding == FEW_DRIVERS and few)


@kernel
def slide_palm(problem, states, work, times, trace):
    """Climb the merit over palm pose, drivers and contacts; arguments and results as ``optimize_contacts``."""
    settings, radius = problem.settings, problem.settings.ppo_trust_region
    for iteration in range(1, settings.max_inner_iterations + 1):
        started, measured = seconds(work.clock), times.collision
        sliding_step(problem.hand, settings, problem.center, states[0], work, radius)
        searched = seconds(work.clock)
        _project(problem, states, work)
        verdict = judge(problem, states[0], states[1], settings.ppo_least_increase, work, times)
        times.search += searched - started
        times.projection += seconds(work.clock) - searched - (times.collision - measured)
        if verdict == CONTINUE:
            states[0] = states[1]
            record(trace, PPO, states[0])
            radius = min(settings.trust_region_growth * radius, settings.ppo_trust_region)
        else:
            radius *= settings.trust_region_shrink
            if radius < settings.least_trust_region:
                return verdict, iteration
    return REACHED_ITERATION_LIMIT, settings.max_inner_iterations


@kernel
def sliding_step(hand, settings, center, state, work, radius):
    """Driver velocities and palm twist into ``work.step``, along which no pad leaves the surface.

    The unknowns x are the drivers' velocities and the palm's twist, its linear part over ``LENGTH``. The gradient g is
    projected on {x : r_f . x = 0} with the rows r_f of the pads' motion along the normals, x = g - R^T (R R^T)^-1 R g,
    and scaled to |x| = ``radius``. ``twist`` is the object's, as in PPO. A driver at its limit and pushed outwards
    leaves the active set.
    """
    step, solver, drivers, fingers = work.step, work.solver, hand.driver_count, hand.finger_count
    count = drivers + 6
    object_quality_gradient(state.contacts, fingers, step.contact_gradient)
    manipulability_gradient(hand, state.drivers, step.driver_gradient)
    step.contact_gradient[:] *= settings.object_weight
    step.driver_gradient[:] *= settings.hand_weight
    step.twist_gradient[:] = 0.0
    add_penalty_gradient(hand, settings, state, center, step)
    solver.right[:drivers] = step.driver_gradient[:drivers]
    for k in range(3):
        solver.right[drivers + k] = -LENGTH * step.twist_gradient[k]
        solver.right[drivers + 3 + k] = -step.twist_gradient[3 + k]
    for f in range(fingers):
        set_row(hand, state, f, TOGETHER, count, get(step.contact_gradient, f), NOWHERE, center, True, solver)
        for i in range(count):
            solver.right[i] += solver.row[i]
    solver.frozen[:] = False
    for _ in range(drivers + 1):
        _project_gradient(hand, state, center, count, work)
        changed = False
        for a in range(drivers):
            if not solver.frozen[a] and at_limit(hand, state.drivers, a, solver.steps[a]):
                solver.frozen[a], changed = True, True
        if not changed:
            break
    squared, steepest = 0.0, 0.0
    for i in range(count):
        squared += solver.steps[i] ** 2
        steepest += solver.right[i] ** 2
    alpha = radius / math.sqrt(squared) if squared > STATIONARY**2 * steepest else 0.0
    for a in range(drivers):
        step.driver_step[a] = alpha * solver.steps[a]
    for k in range(3):
        step.twist[k] = -alpha * LENGTH * solver.steps[drivers + k]
        step.twist[3 + k] = -alpha * solver.steps[drivers + 3 + k]


@kernel
def _project_gradient(hand, state, center, count, work):
    """``solver.right`` less its part along the rows of all pads, into ``solver.steps``; zero for frozen drivers."""
    solver, fingers = work.solver, hand.finger_count
    R, M, b = solver.constraints, solver.multipliers, solver.multiplier
    for f in range(fingers):
        set_row(hand, state, f, TOGETHER, count, get(state.normals, f), NOWHERE, center, True, solver)
        for i in range(count):
            R[i, f] = 0.0 if solver.frozen[i] else solver.row[i]
    for f in range(fingers):
        b[f, 0] = 0.0
        for i in range(count):
            b[f, 0] += R[i, f] * solver.right[i]
        for g in range(fingers):
            M[f, g] = 0.0
            for i in range(count):
                M[f, g] += R[i, f] * R[i, g]
    solve_positive_definite(M, b, fingers)
    for i in range(count):
        solver.steps[i] = 0.0
        if not solver.frozen[i]:
            solver.steps[i] = solver.right[i]
            for f in range(fingers):
                solver.steps[i] -= b[f, 0] * R[i, f]


@kernel
def _project(problem, states, work):
    """Take the step and bring the pads, which slid off along a tangent, back to the surface."""
    hand, settings, state, candidate = problem.hand, problem.settings, states[0], states[1]
    move_palm(work.step.twist, settings.time_step, problem.center, state, work.rotation, candidate)
    for a in range(hand.driver_count):
        angle = state.drivers[a] + settings.time_step * work.step.driver_step[a]
        candidate.drivers[a] = min(max(angle, hand.driver_lower[a]), hand.driver_upper[a])
    candidate.samples[:] = state.samples
    move_drivers(hand, candidate)
    attach_contacts(problem.surface, hand, candidate)
    evaluate(hand, settings, candidate)
    for _ in range(CORRECTIONS):
        pull_pads(problem, candidate, CORRECTION_DAMPING, 0.0, True, work, states[2])
        take_pose(hand, states[2], candidate)
        attach_contacts(problem.surface, hand, candidate)
        evaluate(hand, settings, candidate)
