"""A small move of a finished grasp: contacts along the surface, the palm with them, and every constraint looked at."""

import math

from fingersplit.compilation import kernel
from fingersplit.execution.execution_kernel import find_ways, judge_ways
from fingersplit.feasibility.inspection_kernel import inspect_grasp
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.objects.surface_kernel import closest
from fingersplit.splitting.state_kernel import attach_contacts, evaluate, pad_target
from fingersplit.splitting.tracking_kernel import track
from fingersplit.vectors_kernel import (
    add,
    get,
    multiply,
    norm,
    put,
    rotate,
    scale,
    set_rotation_about,
    subtract,
    vector,
)

__all__ = ["move_grasps"]

FOLLOWED = 12
"""Most steps in which pads follow their contacts."""
ARRIVED = 1e-5
"""[m]; closer than this a pad counts as being where it belongs."""


@kernel
def move_grasps(problem, patches, grasp, steps, turns, shifts, moved, masks, ways, states, work, times):
    """Move a grasp in n ways.

    Contacts take a step along their tangent planes and return to the surface; the palm turns about their mean and is
    shifted; the fingers follow.

    Args:
        problem: ``Problem``.
        patches: ``Patches`` of the object.
        grasp: ``STATE`` record.
        steps: Steps of the contacts, (n, F, 3) [m]; what leaves the surface is dropped.
        turns: Rotation vectors of the palm, (n, 3) [rad].
        shifts: Shifts of the palm, (n, 3) [m].
        moved: Gets the moved grasps, ``STATE`` records (n,).
        masks: Gets the constraints that each violates, (n,).
        ways: Gets the ways in and out of those that violate nothing else, ``WAY`` records (n,).
        states: Scratch, two ``STATE`` records.
        work: ``WORK`` record.
        times: ``PHASE_TIMES`` record, added to.
    """
    for k in range(len(masks)):
        moved[k] = grasp
        state = moved[k]
        _move_palm(problem.hand.finger_count, state, vector(turns[k]), vector(shifts[k]), work)
        _move_contacts(problem, state, steps[k])
        move_drivers(problem.hand, state)
        _follow(problem, state, work)
        attach_contacts(problem.surface, problem.hand, state)
        evaluate(problem.hand, problem.settings, state)
        state.self_clearance = math.inf
        masks[k] = inspect_grasp(problem, patches, state, work, times)
        if masks[k] == 0:
            find_ways(problem, state, states[0], ways[k], work)
            masks[k] = judge_ways(problem.limits, ways[k])


@kernel
def _move_palm(fingers, state, turn, shift, work):
    """Turn the palm about the mean of the contacts and shift it."""
    middle = (0.0, 0.0, 0.0)
    for f in range(fingers):
        middle = add(middle, get(state.contacts, f))
    middle = (middle[0] / fingers, middle[1] / fingers, middle[2] / fingers)
    R, angle = work.rotation, norm(turn)
    set_rotation_about(scale(1.0 / angle, turn) if angle > 0.0 else (1.0, 0.0, 0.0), angle, R)
    offset = rotate(R, subtract(vector(state.palm_position), middle))
    place = add(add(middle, offset), shift)
    multiply(R, state.palm_rotation, work.own.rotations[0])
    for i in range(3):
        state.palm_position[i] = place[i]
        for j in range(3):
            state.palm_rotation[i, j] = work.own.rotations[0, i, j]


@kernel
def _move_contacts(problem, state, steps):
    """Contacts a step on, back on the surface."""
    for f in range(problem.hand.finger_count):
        sample, point, normal = closest(problem.surface, add(get(state.contacts, f), get(steps, f)), state.samples[f])
        state.samples[f] = sample
        put(state.contacts, f, point)
        put(state.normals, f, normal)


@kernel
def _follow(problem, state, work):
    """Bring the pads to their contacts, as far as the drivers go."""
    hand = problem.hand
    for _ in range(FOLLOWED):
        farthest = 0.0
        for f in range(hand.finger_count):
            error = subtract(pad_target(hand, state, f), get(state.pads, f))
            farthest = max(farthest, abs(error[0]) + abs(error[1]) + abs(error[2]))
            put(work.step.displacements, f, error)
        if farthest < ARRIVED:
            return
        track(hand, state, work.step.displacements, work.solver, work.map.drivers)
        state.drivers[:] = work.map.drivers
        move_drivers(hand, state)
