"""Many starts in one call of compiled code: screening, and mapping with splitting, without the GIL."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.feasibility.inspection import inspect_grasp
from fingersplit.splitting.clock import seconds
from fingersplit.splitting.finger_splitting import split_fingers
from fingersplit.splitting.mapping import map_grasp, screen_grasp
from fingersplit.vectors import get

__all__ = ["OUTCOME", "screen_grasps", "split_grasps"]

OUTCOME = np.dtype(
    [
        ("cost", np.float64),
        ("violations", np.int64),
        ("end", np.int64),
        ("rounds", np.int64),
        ("cpo", np.int64),
        ("ppo", np.int64),
        ("times", np.float64, 12),
        ("total", np.float64),
    ],
    align=True,
)
"""How one start went: cost of its mapping (infinite if it has none), how many constraints its grasp violates, what
ended it, counts as ``split_fingers`` returns them, ``state.WORK`` times, and the time of the splitting in all [s]."""


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
        first, second = get(contacts[i], 0), get(contacts[i], 1)
        outcome.cost = map_grasp(problem, table, first, second, get(approaches, i), choices[i], states, work)
        if outcome.cost == math.inf:
            continue
        work.times[:] = 0.0
        began = seconds(work.clock)
        initial[i] = states[0]
        outcome.end, outcome.rounds, outcome.cpo, outcome.ppo = split_fingers(problem, states, work, trace)
        inspect_grasp(problem, patches, states[0], work)
        final[i] = states[0]
        outcome.violations = _count_violations(problem.hand, problem.settings, states[0])
        outcome.total = seconds(work.clock) - began
        outcome.times[:] = work.times


@kernel
def _count_violations(hand, settings, state):
    count = 1 if state.penetration > settings.penetration_tolerance else 0
    for finger in range(hand.finger_count):
        count += 1 if state.residuals[finger] > settings.contact_tolerance else 0
        count += 1 if state.pad_angles[finger] > settings.pad_angle_limit else 0
    for joint in range(hand.joint_count):
        count += 0 if hand.lower[joint] <= state.joints[joint] <= hand.upper[joint] else 1
    return count
