"""Pads pulled onto the surface and turned to face it: damped Gauss-Newton steps of drivers, and of the palm if it may.

The contacts follow the pads, so a pad is free to slide along the surface. Where hands have few drivers the palm moves
with them, since their fingers cannot close every gap alone.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.splitting.palm_motion_kernel import move_palm
from fingersplit.splitting.state_kernel import pad_target
from fingersplit.splitting.tracking_kernel import TOGETHER, add_row, begin_steps, end_steps
from fingersplit.vectors_kernel import column, cross, dot, get, norm, scale, subtract

__all__ = ["LENGTH", "pull_pads", "set_row", "take_pose"]

LENGTH = 0.1
"""[m]; a shift of the palm by this counts as a turn by a radian."""
TOLERATED = 0.35
"""[rad]; usual pads tilted less are left as they are."""


@kernel
def pull_pads(problem, state, damping, facing, palm, work, candidate):
    """One step that closes the gaps of all pads from their contacts, into ``candidate``: drivers and palm.

    Minimises the squared gaps along the surface normals, plus ``facing``^2 times the squared angles by which pads are
    tilted more than tolerated, plus ``damping``^2 times the squared step, within the driver limits.

    Args:
        problem: ``Problem``.
        state: ``STATE`` record whose contacts are nearest to its pads, evaluated.
        damping: [m/rad].
        facing: What a radian between pad and surface counts [m]; 0 leaves it.
        palm: Whether the palm moves, too.
        work: ``WORK`` record.
        candidate: ``STATE`` record that gets drivers and palm pose; not ``state``.
    """
    hand, solver = problem.hand, work.solver
    candidate.drivers[:] = state.drivers
    if not (palm or hand.fingers_coupled):
        for finger in range(hand.finger_count):
            count = begin_steps(hand, state, finger, damping, solver)
            _add_finger(hand, state, finger, finger, problem.center, count, facing, False, work)
            end_steps(hand, state, finger, count, solver, candidate.drivers)
        candidate.palm_rotation[:], candidate.palm_position[:] = state.palm_rotation, state.palm_position
        return
    count = begin_steps(hand, state, TOGETHER, damping, solver)
    if palm:
        count = _add_palm(count, damping, solver)
    for finger in range(hand.finger_count):
        _add_finger(hand, state, finger, TOGETHER, problem.center, count, facing, palm, work)
    end_steps(hand, state, TOGETHER, count, solver, candidate.drivers)
    candidate.palm_rotation[:], candidate.palm_position[:] = state.palm_rotation, state.palm_position
    if palm:
        for k in range(3):
            work.step.twist[k] = -LENGTH * solver.steps[hand.driver_count + k]
            work.step.twist[3 + k] = -solver.steps[hand.driver_count + 3 + k]
        move_palm(work.step.twist, 1.0, problem.center, state, work.rotation, candidate)


@kernel
def _add_palm(count, damping, solver):
    """Six more unknowns, the palm's twist about the object's centre with lengths over ``LENGTH``."""
    for i in range(count, count + 6):
        solver.lowest[i], solver.highest[i], solver.right[i] = -math.inf, math.inf, 0.0
        for k in range(count + 6):
            solver.normal[i, k], solver.normal[k, i] = 0.0, 0.0
        solver.normal[i, i] = damping * damping
    return count + 6


@kernel
def _add_finger(hand, state, finger, among, center, count, facing, palm, work):
    """Rows of one pad: its gap along the normal, and where it should face."""
    solver, n, m = work.solver, get(state.normals, finger), get(state.pad_normals, finger)
    target = pad_target(hand, state, finger)
    set_row(hand, state, finger, among, count, n, (0.0, 0.0, 0.0), center, palm, solver)
    add_row(count, dot(n, subtract(target, get(state.pads, finger))), 1.0, solver)
    turn = cross(m, scale(-1.0, n))
    sine, excess = norm(turn), state.pad_angles[finger] - TOLERATED * hand.pad_angle_scales[finger]
    if facing > 0.0 and sine > 1e-9 and excess > 0.0:
        axis = scale(1.0 / sine, turn)
        other = cross(m, axis)
        set_row(hand, state, finger, among, count, (0.0, 0.0, 0.0), axis, center, palm, solver)
        add_row(count, excess, facing * facing, solver)
        set_row(hand, state, finger, among, count, (0.0, 0.0, 0.0), other, center, palm, solver)
        add_row(count, 0.0, facing * facing, solver)


@kernel
def set_row(hand, state, finger, among, count, along, about, center, palm, solver):
    """How far unit steps move the pad along a vector plus turn it about another, into ``solver.row``."""
    solver.row[:count] = 0.0
    pad = get(state.pads, finger)
    for j in range(hand.joint_counts[finger]):
        joint = hand.joint_indices[finger, j]
        axis = column(state.link_rotations[finger, j], 2)
        motion = cross(axis, subtract(pad, get(state.link_positions[finger], j)))
        value = dot(along, motion) + dot(about, axis)
        for k in range(hand.driver_counts[finger]):
            a = hand.driver_indices[finger, k]
            solver.row[a if among == TOGETHER else k] += hand.coupling[joint, a] * value
    if palm:
        first, moment = hand.driver_count, cross(subtract(pad, center), along)
        for k in range(3):
            solver.row[first + k] = LENGTH * along[k]
            solver.row[first + 3 + k] = moment[k] + about[k]


@kernel
def take_pose(hand, pulled, state):
    """Drivers and palm of ``pulled`` for ``state``."""
    state.drivers[:] = pulled.drivers
    state.palm_rotation[:], state.palm_position[:] = pulled.palm_rotation, pulled.palm_position
    move_drivers(hand, state)
