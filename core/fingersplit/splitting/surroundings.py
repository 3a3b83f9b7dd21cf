"""The grasp around the grasp: how the hand gets there without touching, and what it does to hold.

The pre-grasp opens the fingers along the surface normals at their contacts; the approach backs the palm off against the
direction of travel. Both are tested for collisions on the way. The squeeze drives the pads into the object along the
forces that hold it, as targets for position servos.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.hands.kernel import move_fingers
from fingersplit.splitting.collision import measure_clearances
from fingersplit.splitting.run import Run
from fingersplit.splitting.state import new_states, new_work
from fingersplit.splitting.tracking import track
from fingersplit.transforms import pose_matrix
from fingersplit.vectors import add, get, subtract

__all__ = ["Surroundings", "surroundings"]

OPENING_STEP, OPENING_STEPS = 4e-3, 6
"""Pads open in steps of this length [m], at most so many."""
LEAST_OPENING = 2
"""Steps; with less the hand would brush along the object."""
RETREAT, RETREAT_STEPS = 0.1, 20
"""How far the palm backs off [m], and where on the way it is tested."""
SQUEEZE_DEPTH = 10e-3
"""How far the pad with the largest force is driven into the object [m]."""
TRACKING_ITERATIONS = 3
FREE = 1e-4
"""[m]; links deeper in the object than this touch it."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What to do before and after a grasp.

    Attributes:
        approach: ``object_from_palm`` where the approach begins, (4, 4), None when no way in is free.
        pregrasp_joints: Joint angles for the approach, opened about the grasp, (N,) [rad].
        squeeze_joints: Targets of position servos that press the pads on, (N,) [rad].
    """

    approach: NDArray[np.float64] | None
    pregrasp_joints: NDArray[np.float64]
    squeeze_joints: NDArray[np.float64]


def surroundings(run: Run, forces: NDArray[np.float64] | None) -> Surroundings:
    """Pre-grasp, approach and squeeze of a run's final grasp.

    Args:
        run: The finished run.
        forces: Forces of the fingers on the object, (F, 3) [N]; None squeezes along the surface normals.
    """
    states, work, joints = new_states(2), new_work(), len(run.hand.joint_names)
    direction = -run.final.normals if forces is None else forces
    pushes = SQUEEZE_DEPTH * direction / np.linalg.norm(direction, axis=1).max()
    states[0] = run.last
    _push_pads(run.problem.hand, states, pushes, work)
    squeeze = states[0].joints[:joints].copy()
    states[0] = run.last
    axis = run.final.object_from_palm[:3, :3] @ run.hand.gripper.palm_from_gripper[:, 2]
    free = _open_and_retreat(run.problem, states, -axis, work)
    approach = states[0]
    pose = pose_matrix(approach.palm_rotation, approach.palm_position) if free else None
    return Surroundings(pose, approach.joints[:joints].copy(), squeeze)


@kernel
def _push_pads(hand, states, pushes, work):
    """Move the pads by ``pushes`` (F, 3) [m], as far as the joints go."""
    state = states[0]
    states[1] = states[0]
    for _ in range(TRACKING_ITERATIONS):
        for finger in range(hand.finger_count):
            target = add(get(states[1].pads, finger), get(pushes, finger))
            track(hand, state, finger, subtract(target, get(state.pads, finger)), work, work.joint_step)
        state.joints[:] = work.joint_step
        move_fingers(hand, state)


@kernel
def _open_and_retreat(problem, states, backwards, work):
    """Open the fingers as far as nothing touches, then back the palm off; whether all of it was free."""
    hand, state = problem.hand, states[0]
    pushes = OPENING_STEP * state.normals[: hand.finger_count]
    for opened in range(OPENING_STEPS):
        joints = state.joints.copy()
        _push_pads(hand, states, pushes, work)
        if opened >= LEAST_OPENING and _touches(problem, state, work):
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
