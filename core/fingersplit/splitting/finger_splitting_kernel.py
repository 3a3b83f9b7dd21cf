"""Algorithm 3 of [Fan2018]: the iterative CPO-PPO that splits the fingers of a mapped grasp."""

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.splitting.acceptance_kernel import (
    CONTINUE,
    REACHED_COLLISION,
    REACHED_ITERATION_LIMIT,
    REACHED_OBSTACLE,
    REACHED_PAD_ANGLE,
    REACHED_REGION,
    STOPPED_RISING,
    judge_collision,
    judge_pads,
    judge_surroundings,
)
from fingersplit.splitting.contact_optimization_kernel import optimize_contacts
from fingersplit.splitting.palm_optimization_kernel import optimize_palm
from fingersplit.splitting.pull_kernel import pull_pads, take_pose
from fingersplit.splitting.self_collision_kernel import measure_self_clearance
from fingersplit.splitting.sliding_kernel import slide_palm, slides
from fingersplit.splitting.state_kernel import attach_contacts, evaluate, measure_collision, pad_target
from fingersplit.splitting.trace_kernel import MAP, SETTLE, record
from fingersplit.splitting.tracking_kernel import track
from fingersplit.vectors_kernel import get, put, subtract

__all__ = ["SETTLE_ITERATIONS", "split_fingers"]

SETTLE_ITERATIONS = 30
SETTLING_DAMPING = 1e-3
"""[m/rad]; where the palm settles with the fingers."""
SETTLED = 1e-5
"""[m]; closer than this a fingertip counts as being on the surface."""


@kernel
def split_fingers(problem, states, work, times, trace):
    """Split the fingers from a mapped start.

    Args:
        problem: ``Problem``.
        states: Three ``STATE`` records: the first holds the mapped start (line 2), and on return the grasp it ends
            with, as the search knows it; ``inspect_grasp`` looks at it last.
        work: ``WORK`` record.
        times: ``TIMES`` record, added to.
        trace: ``TraceRows``, appended to.

    Returns:
        What stopped the last CPO or PPO (``acceptance``), rounds, and tangent searches of all CPO and of all PPO.
    """
    settings = problem.settings
    measure_collision(problem, states[0], work, times.map)
    measure_self_clearance(problem.hand, states[0], work.own)
    record(trace, MAP, states[0])
    rounds, cpo_total, ppo_total, end = 0, 0, 0, REACHED_ITERATION_LIMIT
    while rounds < settings.max_outer_iterations:  # line 3
        rounds += 1
        before = states[0].merit
        cpo_end, cpo = optimize_contacts(problem, states, work, times.cpo, trace)  # line 4
        if slides(problem.hand, settings):
            ppo_end, ppo = slide_palm(problem, states, work, times.ppo, trace)
        else:
            ppo_end, ppo = optimize_palm(problem, states, work, times.ppo, trace)  # line 5
        cpo_total += cpo
        ppo_total += ppo
        few = cpo < settings.min_inner_iterations and ppo < settings.min_inner_iterations  # line 6
        if few or states[0].merit - before <= settings.least_round_increase:
            end = STOPPED_RISING
            for bound in (REACHED_PAD_ANGLE, REACHED_COLLISION, REACHED_OBSTACLE, REACHED_REGION):
                if bound in (cpo_end, ppo_end):
                    end = bound
            break
    _settle(problem, states, work, times.settle, trace)
    return end, rounds, cpo_total, ppo_total


@kernel
def _settle(problem, states, work, times, trace):
    """Pull fingertips that lag behind the surface onto it: projections without a tangent step, at full gain.

    The paper's gain closes a tenth of the gap per step, so a fingertip that slid along a curve may end inside it. Once
    all are on the surface, a step that breaks another bound is not taken.
    """
    hand, settings = problem.hand, problem.settings
    for _ in range(SETTLE_ITERATIONS):
        state, candidate = states[0], states[1]
        before = state.residuals[: hand.finger_count].max()
        if before < SETTLED:
            return
        states[1] = states[0]
        if slides(hand, settings):
            pull_pads(problem, state, SETTLING_DAMPING, 0.0, True, work, states[2])
            take_pose(hand, states[2], candidate)
        else:
            for finger in range(hand.finger_count):
                error = subtract(pad_target(hand, state, finger), get(state.pads, finger))
                put(work.step.displacements, finger, error)
            track(hand, state, work.step.displacements, work.solver, candidate.drivers)
            move_drivers(hand, candidate)
        attach_contacts(problem.surface, hand, candidate)
        evaluate(hand, settings, candidate)
        if candidate.residuals[: hand.finger_count].max() > 0.99 * before:
            return
        measure_collision(problem, candidate, work, times)
        pads, collision = judge_pads(hand, settings, state, candidate), judge_collision(settings, state, candidate)
        around = judge_surroundings(problem.scene, hand, state, candidate)
        if before <= settings.contact_tolerance and not pads == collision == around == CONTINUE:
            return
        states[0] = states[1]
        record(trace, SETTLE, states[0])
