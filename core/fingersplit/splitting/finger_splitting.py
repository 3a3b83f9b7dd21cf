"""Algorithm 3 of [Fan2018]: the iterative CPO-PPO that splits the fingers of a mapped grasp."""

from fingersplit.compilation import kernel
from fingersplit.objects.grid import nearest
from fingersplit.objects.surface import touch
from fingersplit.splitting.acceptance import (
    CONTINUE,
    REACHED_COLLISION,
    REACHED_ITERATION_LIMIT,
    REACHED_PAD_ANGLE,
    STOPPED_RISING,
    judge_collision,
    judge_pads,
)
from fingersplit.splitting.collision import penetration, refined_penetration
from fingersplit.splitting.contact_optimization import optimize_contacts
from fingersplit.splitting.palm_optimization import optimize_palm
from fingersplit.splitting.state import (
    PENETRATION,
    attach_contacts,
    copy_state,
    evaluate,
    pad_target,
    place_hand,
)
from fingersplit.splitting.trace import MAP, SETTLE, record
from fingersplit.splitting.tracking import track
from fingersplit.vectors import dot, get, norm, put, subtract

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

    The paper's gain closes a tenth of the gap per step, so a fingertip that slid along a curve may end inside it. Once
    all are on the surface, a step that breaks another bound is not taken.
    """
    settings = problem.settings
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
        pads, collision = judge_pads(settings, state, candidate), judge_collision(problem, state, candidate)
        if state.residuals.max() <= settings.contact_tolerance and (pads != CONTINUE or collision != CONTINUE):
            return
        copy_state(state, candidate)
        record(trace, SETTLE, state)


@kernel
def _inspect(problem, state):
    """Contacts, normals, residuals and Q where the pads touch the triangles, penetration against the surface."""
    surface = problem.surface
    for finger in range(len(state.contacts)):
        _, point = touch(surface, get(state.pose.pads, finger), state.samples[finger])
        state.samples[finger] = nearest(surface.grid, point, state.samples[finger])
        put(state.contacts, finger, point)
        put(state.normals, finger, get(surface.normals, state.samples[finger]))
    evaluate(problem, state)
    for finger in range(len(state.contacts)):
        away = subtract(get(state.pose.pads, finger), get(state.contacts, finger))
        outside = dot(away, get(state.normals, finger)) >= 0.0
        state.residuals[finger] = abs((norm(away) if outside else -norm(away)) - problem.hand.pad_radii[finger])
    refined = refined_penetration(problem.hand, state.pose, problem.surface)
    # What a cloud's view did not see is in no sample of the surface.
    state.scores[PENETRATION] = max(refined, penetration(problem.hand, state.pose, problem.collision))
