"""How a grasp is executed: the hand gets there without touching, and presses to hold.

The pre-grasp opens the fingers along the surface normals at their contacts; the approach backs the palm off against the
direction of travel. Both are tested for collisions on the way. The squeeze is a target for position servos that presses
with the forces that hold the object.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.hands.hand import Hand
from fingersplit.hands.kernel import move_fingers
from fingersplit.splitting.collision import measure_clearances
from fingersplit.splitting.state import Problem, new_states, new_work
from fingersplit.transforms import pose_matrix
from fingersplit.vectors import get

__all__ = ["GraspExecution", "plan_execution"]

OPENING_STEP, OPENING_STEPS = 4e-3, 6
"""Pads open in steps of this length [m], at most so many."""
MIN_OPENING = 2
"""Steps; with less the hand would brush along the object."""
RETREAT, RETREAT_STEPS = 0.1, 20
"""How far the palm backs off [m], and where on the way it is tested."""
OPENING_DAMPING = 0.01
"""[m/rad]; a tenth of a finger's reach, so that a finger which cannot open does not swing."""
SQUEEZE_DEPTH = 10e-3
"""How far the farthest pad would go into the object if it could [m]."""
FREE = 1e-4
"""[m]; links deeper in the object than this touch it."""


@dataclass(frozen=True, eq=False)
class GraspExecution:
    """What to do before and after a grasp.

    Attributes:
        pregrasp_pose: ``object_from_palm`` where the approach begins, (4, 4), None when no straight approach is free.
        pregrasp_joints: Joint angles for the approach, opened about the grasp, (N,) [rad].
        squeeze_joints: Targets of position servos that press the pads on, (N,) [rad].
    """

    pregrasp_pose: NDArray[np.float64] | None
    pregrasp_joints: NDArray[np.float64]
    squeeze_joints: NDArray[np.float64]


def plan_execution(
    problem: Problem, hand: Hand, grasp: np.record, forces: NDArray[np.float64] | None
) -> GraspExecution:
    """Pre-grasp, approach and squeeze of a finished grasp.

    Args:
        problem: What the kernels were given.
        hand: The hand.
        grasp: ``STATE`` record of the grasp.
        forces: Forces of the fingers on the object, (F, 3) [N]; None squeezes along the surface normals.
    """
    states = new_states(1)
    states[0] = grasp
    axis = grasp.palm_rotation @ hand.gripper.palm_from_gripper[:, 2]
    free = _open_and_retreat(problem, states[0], -axis, new_work())
    start = states[0]
    pose = pose_matrix(start.palm_rotation, start.palm_position) if free else None
    pregrasp = start.joints[: len(hand.joint_names)].copy()
    pressing = -grasp.normals[: len(hand.fingers)] if forces is None else forces
    return GraspExecution(pose, pregrasp, _squeeze(problem, hand, grasp, pressing))


def _squeeze(problem: Problem, hand: Hand, grasp: np.record, forces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint targets off the grasp by the torques J^T f times one factor, so that equal servos press like ``forces``.

    Where the lever is short that is a small turn: a finger that points along its spread joint is not swung.
    """
    torques, reach = np.zeros(len(hand.joint_names)), 0.0
    for finger, force in enumerate(forces):
        count = problem.hand.joint_counts[finger]
        J = grasp.jacobians[finger, :, :count]
        torques[problem.hand.joint_indices[finger, :count]] += J.T @ force
        reach = max(reach, float(np.linalg.norm(J @ J.T @ force)))
    joints = grasp.joints[: len(hand.joint_names)]
    return np.asarray(np.clip(joints + SQUEEZE_DEPTH / reach * torques, hand.lower, hand.upper))


@kernel
def _open_fingers(hand, state, work):
    """The smallest joint motion that moves every pad by ``OPENING_STEP`` along its contact's normal, within limits."""
    for finger in range(hand.finger_count):
        count, indices, J = hand.joint_counts[finger], hand.joint_indices[finger], state.jacobians[finger]
        n, squared = get(state.normals, finger), OPENING_DAMPING**2
        for i in range(count):
            work.steps[i] = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
            squared += work.steps[i] ** 2
        for i in range(count):
            j = indices[i]
            angle = state.joints[j] + OPENING_STEP / squared * work.steps[i]
            state.joints[j] = min(max(angle, hand.lower[j]), hand.upper[j])
    move_fingers(hand, state)


@kernel
def _open_and_retreat(problem, state, backwards, work):
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
