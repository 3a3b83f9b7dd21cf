"""Many starts in one call of compiled code: screening, and mapping with splitting, without the GIL."""

import math

from fingersplit.compilation import kernel
from fingersplit.execution.execution_kernel import find_ways, judge_ways
from fingersplit.feasibility.inspection_kernel import inspect_grasp
from fingersplit.splitting.clock_kernel import seconds
from fingersplit.splitting.finger_splitting_kernel import split_fingers
from fingersplit.splitting.mapping_kernel import map_grasp, screen_grasp
from fingersplit.vectors_kernel import get

__all__ = ["screen_grasps", "split_grasps"]


@kernel
def screen_grasps(problem, table, contacts, approaches, states, work, costs, choices):
    """Screen parallel grasps: ``contacts`` (n, 2, 3) [m] and ``approaches`` (n, 3), the first contact for group 0.

    Fills ``costs`` (n, REFINED) and ``choices`` (n, REFINED, 2), see ``screen_grasp``.
    """
    for i in range(len(contacts)):
        first, second = get(contacts[i], 0), get(contacts[i], 1)
        screen_grasp(problem, table, first, second, get(approaches, i), states, work, costs[i], choices[i])


@kernel
def split_grasps(problem, patches, table, contacts, approaches, choices, initial, final, outcomes, states, work, trace):
    """Map and split screened parallel grasps.

    Args:
        problem: ``Problem``.
        patches: ``Patches`` of the object.
        table: ``JawTable``.
        contacts: As ``screen_grasps``.
        approaches: As ``screen_grasps``.
        choices: From ``screen_grasps``.
        initial: Gets the mapped starts, ``STATE`` records (n,).
        final: Gets the grasps they end with, likewise.
        outcomes: ``OUTCOME`` records (n,).
        states: Scratch, three ``STATE`` records.
        work: ``WORK`` record.
        trace: ``TraceRows``; room for one run if n is 1, else empty.
    """
    for i in range(len(contacts)):
        outcome = outcomes[i]
        times, jaws = outcome.times, (get(contacts[i], 0), get(contacts[i], 1), get(approaches, i))
        outcome.cost = map_grasp(problem, table, *jaws, choices[i], states, work, times.map)
        if outcome.cost == math.inf:
            continue
        began = seconds(work.clock)
        states[0].self_clearance = math.inf  # not measured yet; what another start left must not stay
        initial[i] = states[0]
        outcome.end, outcome.rounds, outcome.cpo, outcome.ppo = split_fingers(problem, states, work, times, trace)
        outcome.violations = inspect_grasp(problem, patches, states[0], work, times.settle)
        final[i] = states[0]
        if outcome.violations == 0:
            find_ways(problem, states[0], states[1], outcome.way, work)
            outcome.violations = judge_ways(problem.limits, outcome.way)
        outcome.total = seconds(work.clock) - began
