"""The Map of Algorithm 3, line 2: a parallel grasp becomes a start for the multi-fingered hand.

The palm takes the gripper's place: its approach axis along v_ap, its jaw axis through c_1 and c_2, the fingers of
either group about their jaw's contact. How far the palm stands off and how the fingers are preshaped is searched; the
best of all combinations by reach, pad alignment and clearance is the start.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.objects.surface import closest
from fingersplit.splitting.state import (
    PENETRATION,
    attach_contacts,
    copy_state,
    evaluate,
    measure_collision,
    pad_target,
    place_hand,
)
from fingersplit.splitting.tracking import track
from fingersplit.vectors import add, cross, dot, get, norm, put, scale, subtract

__all__ = ["map_grasp"]

REACH_ITERATIONS = 5
ATTACHED_ITERATIONS = 4
REACH_SCALE = 2e-3
"""[m]; a fingertip this far from its contact costs 1."""
PAD_ANGLE_SCALE = 0.4
"""[rad]; a pad tilted this much costs 1."""
OUT_OF_REACH = 0.02
"""[m]; a start whose fingertips stay farther from their contacts is dropped."""
CLEARANCE_SCALE = 2e-3
"""[m]; a link this deep in the object costs 1."""


@kernel
def map_grasp(problem, gripper, first, second, approach, standoffs, state, candidate, aim, work):
    """Best start for the jaw contacts ``first`` and ``second``.

    Args:
        problem: ``Problem``.
        gripper: ``GripperArrays`` of the hand.
        first: Contact of the fingers in group 0 [m].
        second: Contact of the fingers in group 1 [m].
        approach: Direction of travel towards the object.
        standoffs: Distances of the jaw centre from the palm origin to try, (S,) [m].
        state: Gets the best start.
        candidate: Room for a state.
        aim: Room for a state.
        work: ``Work``.

    Returns:
        Cost of the start, sum of squares over the scales above; infinite when no standoff brings the fingertips near.
    """
    jaw = subtract(first, second)
    jaw = scale(1.0 / norm(jaw), jaw)
    approach = subtract(approach, scale(dot(approach, jaw), jaw))
    if norm(approach) < 1e-6:
        return math.inf
    approach = scale(1.0 / norm(approach), approach)
    lateral = cross(jaw, approach)
    middle = scale(0.5, add(first, second))
    best = math.inf
    for preshape in gripper.preshapes:
        _place_palm(gripper, lateral, jaw, approach, middle, standoffs[0], candidate.pose)
        candidate.pose.joints[:] = preshape
        place_hand(problem, candidate, work)
        _aim(problem, gripper, first, second, middle, lateral, candidate, aim)
        for standoff in standoffs:
            _place_palm(gripper, lateral, jaw, approach, middle, standoff, candidate.pose)
            candidate.pose.joints[:] = preshape
            place_hand(problem, candidate, work)
            candidate.contacts[:], candidate.normals[:], candidate.samples[:] = aim.contacts, aim.normals, aim.samples
            _reach(problem, REACH_ITERATIONS, False, candidate, work)
            evaluate(problem, candidate)
            if candidate.residuals.max() > OUT_OF_REACH:
                continue
            _reach(problem, ATTACHED_ITERATIONS, True, candidate, work)
            evaluate(problem, candidate)
            if _cost(candidate) < best:
                measure_collision(problem, candidate)
                cost = _cost(candidate) + (candidate.scores[PENETRATION] / CLEARANCE_SCALE) ** 2
                if cost < best:
                    best = cost
                    copy_state(state, candidate)
    return best


@kernel
def _place_palm(gripper, lateral, jaw, approach, middle, standoff, pose):
    """``object_from_palm`` that puts the jaw centre at ``middle``."""
    W = gripper.palm_from_gripper
    for i in range(3):
        for k in range(3):
            pose.palm_rotation[i, k] = lateral[i] * W[k, 0] + jaw[i] * W[k, 1] + approach[i] * W[k, 2]
    for i in range(3):
        offset = gripper.center[0] * lateral[i] + gripper.center[1] * jaw[i] + standoff * approach[i]
        pose.palm_position[i] = middle[i] - offset


@kernel
def _aim(problem, gripper, first, second, middle, lateral, state, aim):
    """Contacts of the fingers: about their jaw's contact, as far to the side as their pads stand in the preshape."""
    for group in range(2):
        mean, count = 0.0, 0
        for finger in range(gripper.groups.size):
            if gripper.groups[finger] == group:
                mean += dot(lateral, subtract(get(state.pose.pads, finger), middle))
                count += 1
        mean /= count
        jaw_contact = first if group == 0 else second
        for finger in range(gripper.groups.size):
            if gripper.groups[finger] == group:
                aside = dot(lateral, subtract(get(state.pose.pads, finger), middle)) - mean
                sample, point, normal = closest(problem.surface, add(jaw_contact, scale(aside, lateral)), -1)
                aim.samples[finger] = sample
                put(aim.contacts, finger, point)
                put(aim.normals, finger, normal)


@kernel
def _reach(problem, iterations, attached, state, work):
    """Full tracking steps of all fingers towards their contacts, which follow the fingertips when ``attached``."""
    for _ in range(iterations):
        for finger in range(len(state.contacts)):
            error = subtract(pad_target(problem.hand, state, finger), get(state.pose.pads, finger))
            # Aside first: track reads the old angles again for every joint that meets its limit.
            track(problem.hand, state.pose, finger, error, work, work.joint_step)
        state.pose.joints[:] = work.joint_step
        place_hand(problem, state, work)
        if attached:
            attach_contacts(problem, state)


@kernel
def _cost(state):
    cost = 0.0
    for finger in range(state.residuals.size):
        cost += (state.residuals[finger] / REACH_SCALE) ** 2 + (state.pad_angles[finger] / PAD_ANGLE_SCALE) ** 2
    return cost
