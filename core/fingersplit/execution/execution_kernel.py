"""The way to a grasp: fingers that open about it and a palm that backs off, as far as nothing touches."""

from fingersplit.compilation import kernel
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.splitting.collision_kernel import measure_clearances
from fingersplit.vectors_kernel import get

__all__ = ["open_and_retreat"]

OPENING_STEP, OPENING_STEPS = 4e-3, 6
"""Pads open in steps of this length [m], at most so many."""
MIN_OPENING = 2
"""Steps; with less the hand would brush along the object."""
RETREAT, RETREAT_STEPS = 0.1, 20
"""How far the palm backs off [m], and where on the way it is tested."""
OPENING_DAMPING = 0.01
"""[m/rad]; a tenth of a finger's reach, so that a finger which cannot open does not swing."""
FREE = 1e-4
"""[m]; links deeper in the object than this touch it."""


@kernel
def _open_fingers(hand, state, work):
    """The smallest joint motion that moves every pad by ``OPENING_STEP`` along its contact's normal, within limits."""
    for finger in range(hand.finger_count):
        count, indices, J = hand.joint_counts[finger], hand.joint_indices[finger], state.jacobians[finger]
        n, squared = get(state.normals, finger), OPENING_DAMPING**2
        for i in range(count):
            work.solver.steps[i] = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
            squared += work.solver.steps[i] ** 2
        for i in range(count):
            j = indices[i]
            angle = state.joints[j] + OPENING_STEP / squared * work.solver.steps[i]
            state.joints[j] = min(max(angle, hand.lower[j]), hand.upper[j])
    move_fingers(hand, state)


@kernel
def open_and_retreat(problem, state, backwards, work):
    """Open the fingers as far as nothing touches, then back the palm off; whether all of it was free."""
    hand = problem.hand
    for opened in range(OPENING_STEPS):
        joints = state.joints.copy()
        _open_fingers(hand, state, work)
        if opened >= MIN_OPENING and _touches(problem, state, work):
            state.joints[:] = joints
            move_fingers(hand, state)
            break
    free = not _touches(problem, state, work)
    for _ in range(RETREAT_STEPS):
        for k in range(3):
            state.palm_position[k] += RETREAT / RETREAT_STEPS * backwards[k]
        move_fingers(hand, state)
        free = free and not _touches(problem, state, work)
    return free


@kernel
def _touches(problem, state, work):
    measure_clearances(problem.hand, state, problem.collision, problem.distance, work.rotation)
    return state.penetration > FREE
