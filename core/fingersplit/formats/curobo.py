"""A goal set for cuRobo's ``plan_grasp``: tool poses in the scene's frame, approach and lift as offsets, joints."""

from typing import Any

import numpy as np

from fingersplit.formats.exporting import Export, ExportedGrasp
from fingersplit.formats.file_format import FileFormat
from fingersplit.result.scene import FramePose
from fingersplit.transforms import rotation_from_wxyz

__all__ = ["CUROBO"]

APPROACH_FRAME = "goal"
"""Offsets of an approach are in the frame of the tool at its goal."""


def _write(export: Export) -> dict[str, Any]:
    """Arguments of ``plan_grasp`` under their own names; one pose, offset and set of joints for every grasp."""
    scene = export.result.scene
    described = [_goal(export, grasp) for grasp in export.grasps]
    return {
        "fingersplit": export.origin,
        "frame": "object" if scene is None else scene.frame,
        "tool_frame": export.hand.palm if scene is None else scene.tool_frame,
        "grasp_poses": {
            "position": [goal["pose"]["position"] for goal in described],
            "quaternion_wxyz": [goal["pose"]["wxyz"] for goal in described],
        },
        "grasp_approach_offset": {"frame": APPROACH_FRAME, "position": [goal["approach"] for goal in described]},
        "retract_offset": {
            "frame": "object" if scene is None else scene.frame,
            "position": [goal["retract"] for goal in described],
        },
        "disable_collision_links": _touching_links(export),
        "joint_names": list(export.hand.joint_names),
        "approach_joints": [grasp.opened.joints.tolist() for grasp in export.grasps],
        "grasp_joints": [grasp.pose.joints.tolist() for grasp in export.grasps],
        "squeeze_joints": [grasp.squeeze.joints.tolist() for grasp in export.grasps],
    }


def _goal(export: Export, exported: ExportedGrasp) -> dict[str, Any]:
    """Tool pose, where the approach begins from it (tool frame), and where the lift goes (scene frame) [m]."""
    grasp = export.result.grasp(exported.rank)
    x, y, z = exported.pose.position.tolist()
    w, i, j, k = exported.pose.wxyz.tolist()
    tool = FramePose((x, y, z), (w, i, j, k)) if grasp.world is None else grasp.world.tool
    rotation, approach, retract = rotation_from_wxyz(tool.wxyz), np.zeros(3), np.zeros(3)
    if grasp.approach_path is not None and grasp.pregrasp is not None:
        approach = -grasp.approach_path.distance * rotation.T @ np.array(grasp.approach_path.direction_in_world)
    if grasp.retreat_path is not None:
        retract = grasp.retreat_path.distance * np.array(grasp.retreat_path.direction_in_world)
    return {
        "pose": {"position": list(tool.position), "wxyz": list(tool.wxyz)},
        "approach": approach.tolist(),
        "retract": retract.tolist(),
    }


def _touching_links(export: Export) -> list[str]:
    """Links that carry a pad: in the grasp they touch the object."""
    links = export.hand.model.links
    return [links[pad.link].name for pad in export.hand.pads]


CUROBO = FileFormat("curobo", "Goal set for cuRobo's plan_grasp", "json", write=_write)
