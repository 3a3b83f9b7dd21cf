"""How a grasp is executed: the hand gets there without touching, and presses to hold.

The pre-grasp opens the fingers along the surface normals at their contacts; the approach is a straight way in.
Both, and the way out with the object, are swept. The squeeze is a target for position servos that presses with the
forces that hold the object.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.execution.execution_kernel import find_ways
from fingersplit.hands.drivers import joints_of
from fingersplit.hands.hand import Hand
from fingersplit.scene.ways import new_way
from fingersplit.splitting.state import Problem, new_states, new_work
from fingersplit.transforms import pose_matrix

__all__ = ["GraspExecution", "plan_execution"]

SQUEEZE_DEPTH = 10e-3
"""How far the farthest pad would go into the object if it could [m]."""


@dataclass(frozen=True, eq=False)
class GraspExecution:
    """What to do before and after a grasp.

    Attributes:
        pregrasp_pose: ``object_from_palm`` where the approach begins, (4, 4), None when no straight approach is free
            over the least distance.
        pregrasp_joints: Joint angles for the approach, opened about the grasp, (N,) [rad].
        squeeze_joints: Targets of position servos that press the pads on, (N,) [rad].
        approach_direction: Unit direction of travel towards the grasp, object frame (3,).
        approach_distance: How far it is free [m].
        blocked_by: What ends it (``scene.ways``), when that is less than wanted.
        retreat_direction: Unit direction in which hand and object leave, object frame (3,).
        retreat_distance: How far the hand may go [m].
        retreat_blocked_by: What ends that, as ``blocked_by``.
    """

    pregrasp_pose: NDArray[np.float64] | None
    pregrasp_joints: NDArray[np.float64]
    squeeze_joints: NDArray[np.float64]
    approach_direction: NDArray[np.float64]
    approach_distance: float
    blocked_by: int
    retreat_direction: NDArray[np.float64]
    retreat_distance: float
    retreat_blocked_by: int


def plan_execution(
    problem: Problem,
    hand: Hand,
    grasp: np.record,
    forces: NDArray[np.float64] | None,
    way: np.record | None = None,
) -> GraspExecution:
    """Pre-grasp, approach, squeeze and retreat of a finished grasp.

    Args:
        problem: What the kernels were given.
        hand: The hand.
        grasp: ``STATE`` record of the grasp.
        forces: Forces of the fingers on the object, (F, 3) [N]; None squeezes along the surface normals.
        way: ``WAY`` record of the grasp, if it is known.
    """
    if way is None or not way.known:
        way = new_way()
        find_ways(problem, grasp, new_states(1)[0], way, new_work())
    pose = None
    if way.distance > 0.0 and way.distance >= problem.limits.min_distance:
        pose = pose_matrix(grasp.palm_rotation, grasp.palm_position - way.distance * way.direction)
    pressing = -grasp.normals[: len(hand.fingers)] if forces is None else forces
    return GraspExecution(
        pregrasp_pose=pose,
        pregrasp_joints=way.joints[: len(hand.joint_names)].copy(),
        squeeze_joints=_squeeze(problem, grasp, pressing),
        approach_direction=way.direction.copy(),
        approach_distance=float(way.distance),
        blocked_by=int(way.blocked_by),
        retreat_direction=way.retreat.copy(),
        retreat_distance=float(way.retreat_distance),
        retreat_blocked_by=int(way.retreat_blocked_by),
    )


def _squeeze(problem: Problem, grasp: np.record, forces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint targets off the grasp by the driver torques J^T f times one factor, so that equal servos press so.

    Where the lever is short that is a small turn: a finger that points along its spread joint is not swung.
    """
    arrays = problem.hand
    torques, count = np.zeros(arrays.driver_count), arrays.driver_count
    for finger, force in enumerate(forces):
        drivers = arrays.driver_indices[finger, : arrays.driver_counts[finger]]
        torques[drivers] += grasp.jacobians[finger, :, : len(drivers)].T @ force
    reach = 0.0
    for finger in range(len(forces)):
        drivers = arrays.driver_indices[finger, : arrays.driver_counts[finger]]
        reach = max(reach, float(np.linalg.norm(grasp.jacobians[finger, :, : len(drivers)] @ torques[drivers])))
    drivers = grasp.drivers[:count] + SQUEEZE_DEPTH / reach * torques
    return joints_of(arrays, np.clip(drivers, arrays.driver_lower[:count], arrays.driver_upper[:count]))
