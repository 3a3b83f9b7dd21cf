"""What an answer says of the world around the object: poses in it, ways, clearance, what was rejected and why."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.execution.execution import GraspExecution
from fingersplit.feasibility.violations import blocker_name
from fingersplit.planning.relaxing import Relaxation as FoundRelaxation
from fingersplit.planning.relaxing import count_obstacles
from fingersplit.planning.run import Run
from fingersplit.planning.search import Search
from fingersplit.result.scene import Clearance, FramePose, Relaxation, SceneSummary, Way, WorldPoses
from fingersplit.scene.obstacles import new_slacks
from fingersplit.scene.obstacles_kernel import measure_slacks
from fingersplit.scene.preparing import PreparedScene
from fingersplit.scene.ways import NOTHING
from fingersplit.transforms import wxyz_from_rotation

__all__ = ["clearance_of", "scene_summary", "ways_of", "world_poses"]

MEASURED = 0.3
"""[m]; obstacles farther away than this have no clearance to speak of."""


def scene_summary(found: Search) -> SceneSummary:
    """The scene of a search and what came of it."""
    scene = found.scene
    return SceneSummary(
        frame=scene.constraints.scene.frame,
        tool_frame=scene.constraints.end_effector.tool_frame,
        object_pose=_frame_pose(scene.world_from_object),
        stable_pose_share=scene.stable_pose_share,
        warnings=scene.warnings,
        rejected_by=count_obstacles(found.runs, scene),
        relaxations=tuple(_relaxation(one) for one in found.relaxations),
    )


def world_poses(run: Run, execution: GraspExecution, scene: PreparedScene) -> WorldPoses:
    """Palm and tool of a grasp in the scene's frame."""
    palm = scene.world_from_object @ run.final.object_from_palm
    palm_from_tool = np.linalg.inv(scene.constraints.end_effector.tool_from_palm.matrix)
    pregrasp = execution.pregrasp_pose
    return WorldPoses(
        palm=_frame_pose(palm),
        tool=_frame_pose(palm @ palm_from_tool),
        pregrasp_tool=None if pregrasp is None else _frame_pose(scene.world_from_object @ pregrasp @ palm_from_tool),
    )


def ways_of(execution: GraspExecution, scene: PreparedScene) -> tuple[Way, Way]:
    """The way in and the way out of a grasp."""
    way_in = _way(execution.approach_direction, execution.approach_distance, execution.blocked_by, scene)
    way_out = _way(execution.retreat_direction, execution.retreat_distance, execution.retreat_blocked_by, scene)
    return way_in, way_out


def clearance_of(run: Run, scene: PreparedScene) -> Clearance | None:
    """Where the hand is nearest to an obstacle in a grasp; None where none is near."""
    if scene.arrays is None:
        return None
    found, work = new_slacks()
    arrays = run.problem.hand
    least = measure_slacks(scene.arrays, arrays, run.last, found, work, MEASURED)
    if not np.isfinite(least):
        return None
    shape = int(found.slacks[: arrays.shape_count].argmin())
    number = int(found.obstacles[shape])
    distance = float(least) + _clearance(scene, number, shape, run)
    return Clearance(distance=distance, link=run.hand.shape_names[shape], obstacle=scene.names[number])


def _clearance(scene: PreparedScene, number: int, shape: int, run: Run) -> float:
    """What a slack leaves out of the distance to an obstacle [m]."""
    world, hand = scene.constraints.scene, run.problem.hand
    supports = world.support_surfaces
    finger = int(hand.shape_fingers[shape])
    pad = finger >= 0 and hand.shape_links[shape] == hand.joint_counts[finger] - 1
    if number < len(supports) and pad and supports[number].allow_finger_contact:
        return 0.0
    return world.clearance


def _way(direction: NDArray[np.float64], distance: float, blocked_by: int, scene: PreparedScene) -> Way:
    return Way(
        direction=_vector(direction),
        direction_in_world=_vector(scene.world_from_object[:3, :3] @ direction),
        distance=distance,
        blocked_by=None if blocked_by == NOTHING else blocker_name(blocked_by, scene.names).strip("'"),
    )


def _relaxation(found: FoundRelaxation) -> Relaxation:
    return Relaxation(found.constraint, found.amount, found.unit, found.feasible, found.sentence)


def _frame_pose(pose: NDArray[np.float64]) -> FramePose:
    w, x, y, z = wxyz_from_rotation(pose[:3, :3]).tolist()
    return FramePose(_vector(pose[:3, 3]), (w, x, y, z))


def _vector(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
