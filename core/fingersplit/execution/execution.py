"""How a grasp is executed: the hand gets there without touching, and presses to hold.

The pre-grasp opens the fingers along the surface normals at their contacts; the approach is a straight way in.
Both, and the way out with the object, are swept. The squeeze is the grip that ``contacts.grip_plan`` plans.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip_plan import GripPlan
from fingersplit.execution.execution_kernel import find_ways
from fingersplit.hands.hand import Hand
from fingersplit.scene.ways import new_way
from fingersplit.splitting.state import Problem, new_states, new_work
from fingersplit.transforms import pose_matrix

__all__ = ["GraspExecution", "plan_execution"]


@dataclass(frozen=True, eq=False)
class GraspExecution:
    """What to do before and after a grasp.

    Attributes:
        pregrasp_pose: ``object_from_palm`` where the approach begins, (4, 4), None when no straight approach is free
            over the least distance.
        pregrasp_joints: Joint angles for the approach, opened about the grasp, (N,) [rad].
        grip: How hard to grip, and what to send to the hand for it.
        approach_direction: Unit direction of travel towards the grasp, object frame (3,).
        approach_distance: How far it is free [m].
        blocked_by: What ends it (``scene.ways``), when that is less than wanted.
        retreat_direction: Unit direction in which hand and object leave, object frame (3,).
        retreat_distance: How far the hand may go [m].
        retreat_blocked_by: What ends that, as ``blocked_by``.
    """

    pregrasp_pose: NDArray[np.float64] | None
    pregrasp_joints: NDArray[np.float64]
    grip: GripPlan
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
    grip: GripPlan,
    way: np.record | None = None,
) -> GraspExecution:
    """Pre-grasp, approach, squeeze and retreat of a finished grasp.

    Args:
        problem: What the kernels were given.
        hand: The hand.
        grasp: ``STATE`` record of the grasp.
        grip: Its grip.
        way: ``WAY`` record of the grasp, if it is known.
    """
    # Fields by key: as attributes of a record they cost several times as much.
    if way is None or not way["known"]:
        way = new_way()
        find_ways(problem, grasp, new_states(1)[0], way, new_work())
    pose, distance, direction = None, float(way["distance"]), way["direction"].copy()
    if distance > 0.0 and distance >= problem.limits["min_distance"]:
        pose = pose_matrix(grasp["palm_rotation"], grasp["palm_position"] - distance * direction)
    return GraspExecution(
        pregrasp_pose=pose,
        pregrasp_joints=way["joints"][: len(hand.joint_names)].copy(),
        grip=grip,
        approach_direction=direction,
        approach_distance=distance,
        blocked_by=int(way["blocked_by"]),
        retreat_direction=way["retreat"].copy(),
        retreat_distance=float(way["retreat_distance"]),
        retreat_blocked_by=int(way["retreat_blocked_by"]),
    )
