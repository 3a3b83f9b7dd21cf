"""The way to a grasp and away from it: fingers open about it, the palm backs off, as far as nothing is in the way.

Motions are swept by conservative advancement [Mirtich1996]: no point of a hand that does not turn moves farther than
the hand, so it may move on by what is free about it. Beside something the steps are ``limits.step``.
"""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.feasibility.violations_kernel import NO_APPROACH, NO_RETREAT, SLACK_TOLERANCE
from fingersplit.hands.kinematics_kernel import move_drivers, move_fingers, place_on_link
from fingersplit.objects.signed_distance_kernel import least_distance
from fingersplit.scene.limits_kernel import direction_allowed, palm_allowed
from fingersplit.scene.obstacles_kernel import measure_slacks
from fingersplit.scene.ways import BY_OBJECT, BY_WORKSPACE, NOT_ALLOWED, NOTHING
from fingersplit.splitting.collision_kernel import RANGE, measure_clearances
from fingersplit.splitting.tracking_kernel import TOGETHER, add_row, begin_steps, end_steps
from fingersplit.vectors_kernel import add, column, dot, get, norm, rotate, scale, subtract, vector

__all__ = ["find_ways", "judge_ways"]

OPENING_STEP, OPENING_STEPS = 4e-3, 6
"""Pads open in steps of this length [m], at most so many."""
MIN_OPENING = 2
"""Steps; with less the hand would brush along the object."""
OPENING_DAMPING = 0.01
"""[m/rad]; a tenth of a finger's reach, so that a finger which cannot open does not swing."""
FREE = 1e-4
"""[m]; links deeper in the object than this touch it."""
TILT, MAX_TILT = 0.35, 0.7
"""[rad]; how far directions of travel are tilted against the palm's axis, and how far they may be at most."""
LOOKED_AHEAD = 0.012
"""[m]; obstacles farther away than this do not shorten the steps of a sweep."""
INSIDE_CONE = 1e-3
"""[rad]; a direction on the rim of a cone is taken this far inside."""


@kernel
def find_ways(problem, grasp, probe, way, work):
    """Find how to open about a grasp, a direction to come from, and how far it may leave, into ``way``.

    The palm's own axis with the widest opening comes first, then other allowed directions near it, then narrower
    openings; the first way that is free over the desired distance is taken, or else the longest.

    Args:
        problem: ``Problem``.
        grasp: ``STATE`` record of the grasp.
        probe: ``STATE`` record, scratch.
        way: ``WAY`` record.
        work: ``WORK`` record.
    """
    hand, limits = problem.hand, problem.limits
    openings = np.empty((OPENING_STEPS, len(grasp.joints)))
    probe = _copy(grasp, probe)
    widest = _open(problem, probe, openings, work)
    way.joints[:] = openings[widest]
    way.distance, way.blocked_by = 0.0, NOT_ALLOWED
    axis = rotate(grasp.palm_rotation, column(limits.palm_from_gripper, 2))
    _put(way.direction, axis)
    opening = widest
    while True:
        free, by = _closes_freely(problem.scene, hand, limits, grasp, openings[opening], probe, work)
        if not free:
            if way.distance == 0.0:
                way.blocked_by = by
        elif _try_directions(problem, grasp, openings[opening], probe, way, work):
            break
        if opening < MIN_OPENING:
            break
        opening = max(opening - 2, MIN_OPENING - 1)
    _retreat(problem.scene, hand, limits, grasp, probe, way, work)
    way.known = True


@kernel
def judge_ways(limits, way):
    """Mask of the constraints that a grasp's ways in and out violate."""
    mask = 0
    if limits.required and way.distance < limits.min_distance:
        mask |= 1 << NO_APPROACH
    if limits.required and way.retreat_distance < limits.retreat_min_distance:
        mask |= 1 << NO_RETREAT
    return mask


@kernel
def _put(out, direction):
    """Write a vector into a (3,) array."""
    out[0], out[1], out[2] = direction


@kernel
def _copy(grasp, probe):
    probe.palm_rotation[:], probe.palm_position[:] = grasp.palm_rotation, grasp.palm_position
    probe.drivers[:], probe.joints[:], probe.normals[:] = grasp.drivers, grasp.joints, grasp.normals
    return probe


@kernel
def _open(problem, probe, openings, work):
    """Joints after each step of opening into ``openings``; the last step that touches nothing, at least the least."""
    hand = problem.hand
    move_fingers(hand, probe)
    for step in range(OPENING_STEPS):
        _open_fingers(hand, probe, work)
        openings[step] = probe.joints
        if step >= MIN_OPENING and _gap(problem, probe, work)[0] < 0.0:
            return step - 1
    return OPENING_STEPS - 1


@kernel
def _open_fingers(hand, state, work):
    """The smallest driver motion that moves every pad by ``OPENING_STEP`` along its contact's normal, within limits."""
    if hand.fingers_coupled:
        _open_together(hand, state, work)
        return
    for finger in range(hand.finger_count):
        count, indices, J = hand.driver_counts[finger], hand.driver_indices[finger], state.jacobians[finger]
        n, squared = get(state.normals, finger), OPENING_DAMPING**2
        for i in range(count):
            work.solver.steps[i] = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
            squared += work.solver.steps[i] ** 2
        for i in range(count):
            a = indices[i]
            angle = state.drivers[a] + OPENING_STEP / squared * work.solver.steps[i]
            state.drivers[a] = min(max(angle, hand.driver_lower[a]), hand.driver_upper[a])
    move_drivers(hand, state)


@kernel
def _open_together(hand, state, work):
    """The same for fingers that share drivers, all in one system."""
    count, solver = begin_steps(hand, state, TOGETHER, OPENING_DAMPING, work.solver), work.solver
    for finger in range(hand.finger_count):
        J, n = state.jacobians[finger], get(state.normals, finger)
        solver.row[:] = 0.0
        for i in range(hand.driver_counts[finger]):
            solver.row[hand.driver_indices[finger, i]] = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
        add_row(count, OPENING_STEP, 1.0, solver)
    end_steps(hand, state, TOGETHER, count, solver, work.map.drivers)
    state.drivers[:] = work.map.drivers
    move_drivers(hand, state)


@kernel
def _try_directions(problem, grasp, joints, probe, way, work):
    """Sweep the approach along every candidate direction; whether one is free over the desired distance."""
    limits, R = problem.limits, grasp.palm_rotation
    lateral = rotate(R, column(limits.palm_from_gripper, 0))
    jaw = rotate(R, column(limits.palm_from_gripper, 1))
    axis = rotate(R, column(limits.palm_from_gripper, 2))
    for candidate in range(5 + limits.cone_count):
        if candidate == 0:
            direction = axis
        elif candidate <= limits.cone_count:
            direction = _into_cone(axis, get(limits.cone_axes, candidate - 1), limits.cone_cosines[candidate - 1])
        else:
            tilt = candidate - limits.cone_count - 1
            side = lateral if tilt < 2 else jaw
            sign = 1.0 if tilt % 2 == 0 else -1.0
            direction = add(scale(math.cos(TILT), axis), scale(sign * math.sin(TILT), side))
        if not direction_allowed(limits, direction) or dot(direction, axis) < math.cos(MAX_TILT):
            continue
        _copy(grasp, probe)
        probe.joints[:] = joints
        distance, by = _sweep(problem, probe, scale(-1.0, direction), limits.desired_distance, work)
        if distance > way.distance or way.blocked_by == NOT_ALLOWED:
            way.distance, way.blocked_by = distance, by
            way.joints[:] = joints
            _put(way.direction, direction)
        if distance >= limits.desired_distance:
            return True
    return False


@kernel
def _into_cone(axis, middle, cosine):
    """The direction of a cone that is nearest to ``axis``."""
    along = dot(axis, middle)
    if along >= cosine:
        return axis
    across = subtract(axis, scale(along, middle))
    length = norm(across)
    angle = max(math.acos(min(max(cosine, -1.0), 1.0)) - INSIDE_CONE, 0.0)
    if length < 1e-9:
        return middle
    return add(scale(math.cos(angle), middle), scale(math.sin(angle) / length, across))


@kernel
def _sweep(problem, probe, backwards, most, work):
    """Move the palm along ``backwards`` while nothing is in the way; how far it got [m], and what ended it."""
    limits, free, travelled, slack = problem.limits, 0.0, 0.0, -1.0
    origin = vector(probe.palm_position)
    while True:
        _put(probe.palm_position, add(origin, scale(travelled, backwards)))
        move_fingers(problem.hand, probe)
        if not palm_allowed(limits, vector(probe.palm_position)):
            return free, BY_WORKSPACE
        gap = _object_gap(problem, probe, work)
        if gap < 0.0:
            return free, BY_OBJECT
        if slack < gap:  # of what was found before, as much is certainly left
            slack, by = _slack(problem.scene, problem.hand, probe, work)
            if slack < -SLACK_TOLERANCE:
                return free, by
        free, left = travelled, most - travelled
        there = left <= 0.0  # where the slack may be below zero by what counts as rounding
        if there or (min(gap, slack) >= left and palm_allowed(limits, add(origin, scale(most, backwards)))):
            return most, NOTHING
        moved = min(max(min(gap, slack), limits.step), left)
        travelled, slack = (most if moved == left else travelled + moved), slack - moved


@kernel
def _gap(problem, probe, work):
    """How far the hand may move in any direction without touching anything [m], -1 where it touches; and what."""
    gap = _object_gap(problem, probe, work)
    if gap < 0.0:
        return -1.0, BY_OBJECT
    slack, by = _slack(problem.scene, problem.hand, probe, work)
    if slack < -SLACK_TOLERANCE:
        return -1.0, by
    return max(min(gap, slack), 0.0), NOTHING


@kernel
def _object_gap(problem, probe, work):
    """How far the hand may move in any direction without touching the object [m], -1 where it touches."""
    hand, distance = problem.hand, problem.distance
    measure_clearances(hand, probe, problem.collision, distance, work.rotation)
    if probe.penetration > FREE:
        return -1.0
    gap = math.inf
    for shape in range(hand.shape_count):
        near = probe.clearances[shape]
        if near == math.inf:
            center = place_on_link(hand, probe, shape, get(hand.shape_positions, shape))
            near = max(least_distance(distance, center) - hand.shape_radii[shape], RANGE)
        gap = min(gap, near)
    return max(gap, 0.0)


@kernel
def _slack(scene, hand, probe, work):
    """Least slack of the hand from obstacles [m], and the obstacle."""
    if scene is None:
        return math.inf, NOTHING
    least = measure_slacks(scene, hand, probe, probe.around, work.around, LOOKED_AHEAD)
    for shape in range(hand.shape_count):
        if probe.around.slacks[shape] == least and least < math.inf:
            return least, probe.around.obstacles[shape]
    return LOOKED_AHEAD, NOTHING


@kernel
def _closes_freely(scene, hand, limits, grasp, joints, probe, work):
    """Whether the fingers keep clear of obstacles while they close from ``joints`` to the grasp; else of which not."""
    if scene is None:
        return True, NOTHING
    longest = 0.0
    for finger in range(hand.finger_count):
        turned = 0.0
        for i in range(hand.joint_counts[finger]):
            j = hand.joint_indices[finger, i]
            turned += abs(grasp.joints[j] - joints[j])
        longest = max(longest, turned * scene.hand_reach)  # no point of the finger moves farther
    _copy(grasp, probe)
    share = 0.0
    while True:
        for j in range(hand.joint_count):
            probe.joints[j] = joints[j] + share * (grasp.joints[j] - joints[j])
        move_fingers(hand, probe)
        slack, by = _slack(scene, hand, probe, work)
        if slack < -SLACK_TOLERANCE:
            return False, by
        if share >= 1.0 or longest == 0.0:
            return True, NOTHING
        share = min(share + max(slack, limits.step) / longest, 1.0)


@kernel
def _retreat(scene, hand, limits, grasp, probe, way, work):
    """How far the hand may leave with the object before it meets an obstacle."""
    retreat = vector(limits.retreat)
    if limits.retreat_in_palm:
        retreat = rotate(grasp.palm_rotation, retreat)
    _put(way.retreat, retreat)
    way.retreat_distance, way.retreat_blocked_by = limits.retreat_desired_distance, NOTHING
    if scene is None:
        return
    _copy(grasp, probe)
    origin, free, travelled = vector(grasp.palm_position), 0.0, 0.0
    while True:
        _put(probe.palm_position, add(origin, scale(travelled, retreat)))
        move_fingers(hand, probe)
        slack, by = _slack(scene, hand, probe, work)
        if slack < -SLACK_TOLERANCE:
            way.retreat_distance, way.retreat_blocked_by = free, by
            return
        free = travelled
        if travelled >= limits.retreat_desired_distance:
            return
        travelled = min(travelled + max(slack, limits.step), limits.retreat_desired_distance)
