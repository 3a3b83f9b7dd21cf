"""Algorithm 3 of [Fan2018]: the iterative CPO-PPO that splits the fingers of a mapped grasp."""

from fingersplit.compilation import kernel
from fingersplit.objects.surface import touch
from fingersplit.splitting.acceptance import (
    REACHED_COLLISION,
    REACHED_ITERATION_LIMIT,
    REACHED_PAD_ANGLE,
    STOPPED_RISING,
)
from fingersplit.splitting.collision import penetration
from fingersplit.splitting.contact_optimization import optimize_contacts
from fingersplit.splitting.palm_optimization import optimize_palm
from fingersplit.splitting.state import (
    PENETRATION,
    attach_contacts,
    copy_state,
    evaluate,
    evaluate_quality,
    measure_collision,
    pad_target,
    place_hand,
)
from fingersplit.splitting.trace import MAP, SETTLE, record
from fingersplit.splitting.tracking import track
from fingersplit.vectors import dot, get, put, subtract

__all__ = ["split_fingers"]

SETTLE_ITERATIONS = 30
SETTLED = 1e-5
"""[m]; closer than this a fingertip counts as being on the surface."""


@kernel
def split_fingers(problem, state, candidate, trial, work, trace):
    """Split the fingers from a mapped start.

    Args:
        problem: ``Problem``.
        state: The mapped start (line 2); the final grasp on return.
        candidate: Room for a state.
        trial: Room for a state.
        work: ``Work``.
        trace: ``TraceArrays``, appended to.

    Returns:
        What stopped the last CPO or PPO (``acceptance``), rounds, and tangent searches of all CPO and of all PPO.
    """
    settings = problem.settings
    record(trace, MAP, state)
    rounds, cpo_total, ppo_total, end = 0, 0, 0, REACHED_ITERATION_LIMIT
    while rounds < settings.max_outer_iterations:  # line 3
        rounds += 1
        cpo_end, cpo = optimize_contacts(problem, state, candidate, trial, work, trace)  # line 4
        ppo_end, ppo = optimize_palm(problem, state, candidate, work, trace)  # line 5
        cpo_total += cpo
        ppo_total += ppo
        if cpo < settings.min_inner_iterations and ppo < settings.min_inner_iterations:  # line 6
            end = STOPPED_RISING
            for bound in (REACHED_PAD_ANGLE, REACHED_COLLISION):
                if bound in (cpo_end, ppo_end):
                    end = bound
            break
    _settle(problem, state, candidate, work, trace)
    _inspect(problem, state)
    return end, rounds, cpo_total, ppo_total


@kernel
def _settle(problem, state, candidate, work, trace):
    """Pull fingertips that lag behind the surface onto it: projections without a tangent step, at full gain.

    The paper's gain closes a tenth of the gap per step, so a fingertip that slid along a curve may end inside it.
    """
    for _ in range(SETTLE_ITERATIONS):
        if state.residuals.max() < SETTLED:
            return
        copy_state(candidate, state)
        for finger in range(len(state.contacts)):
            error = subtract(pad_target(problem.hand, state, finger), get(state.pose.pads, finger))
            track(problem.hand, state.pose, finger, error, work, candidate.pose.joints)
        place_hand(problem, candidate, work)
        attach_contacts(problem, candidate)
        evaluate(problem, candidate)
        if candidate.residuals.max() > 0.99 * state.residuals.max():
            return
        measure_collision(problem, candidate)
        copy_state(state, candidate)
        record(trace, SETTLE, state)


@kernel
def _inspect(problem, state):
    """Contacts, residuals and Q against the triangles, penetration against every sample, for the final verdict."""
    for finger in range(len(state.contacts)):
        pad = get(state.pose.pads, finger)
        distance, point = touch(problem.surface, pad, state.samples[finger])
        outside = dot(subtract(pad, point), get(state.normals, finger)) >= 0.0
        put(state.contacts, finger, point)
        state.residuals[finger] = abs((distance if outside else -distance) - problem.hand.pad_radii[finger])
    evaluate_quality(problem, state)
    state.scores[PENETRATION] = penetration(problem.hand, state.pose, problem.surface.grid)
