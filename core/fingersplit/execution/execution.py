"""How a grasp is executed: the hand gets there without touching, and presses to hold.

The pre-grasp opens the fingers along the surface normals at their contacts; the approach backs the palm off against the
direction of travel. Both are tested for collisions on the way. The squeeze is a target for position servos that presses
with the forces that hold the object.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.execution.execution_kernel import open_and_retreat
from fingersplit.hands.hand import Hand
from fingersplit.splitting.state import Problem, new_states, new_work
from fingersplit.transforms import pose_matrix

__all__ = ["GraspExecution", "plan_execution"]

SQUEEZE_DEPTH = 10e-3
"""How far the farthest pad would go into the object if it could [m]."""


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
    free = open_and_retreat(problem, states[0], -axis, new_work())
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
