"""moveit_msgs/Grasp messages, field for field, as JSON or YAML."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.formats.exporting import Export, ExportedGrasp
from fingersplit.formats.file_format import FileFormat

__all__ = ["MOVEIT", "MOVEIT_YAML"]

APPROACH, MIN_APPROACH = 0.10, 0.02
"""Wanted and least length of a straight way in where no pre-grasp is known [m]."""
LIFT, MIN_LIFT = 0.10, 0.02
"""Wanted and least height of the lift after the grasp [m]."""
LIFT_FRAME = "world"
"""Frame of the lift, z upwards; the object's own frame says nothing about where up is."""
NO_LIMIT = 0.0
"""``max_contact_force`` that sets no limit."""


def _write(export: Export) -> dict[str, Any]:
    """``{"fingersplit": origin, "grasps": [moveit_msgs/Grasp, ...]}``."""
    return {"fingersplit": export.origin, "grasps": [_message(export, grasp) for grasp in export.grasps]}


def _message(export: Export, grasp: ExportedGrasp) -> dict[str, Any]:
    palm = export.hand.palm
    way_in, length = grasp.way_in() or (export.hand.gripper.palm_from_gripper[:, 2], APPROACH)
    least = _approach(export).get("min_distance", MIN_APPROACH)
    return {
        "id": f"grasp_{grasp.rank}",
        "pre_grasp_posture": _posture(export, grasp.opened.joints),
        "grasp_posture": _posture(export, grasp.squeeze.joints),
        "grasp_pose": {
            "header": _header(export.object_name),
            "pose": {
                "position": _xyz(grasp.pose.position),
                "orientation": {**_xyz(grasp.pose.wxyz[1:]), "w": float(grasp.pose.wxyz[0])},
            },
        },
        "grasp_quality": grasp.quality,
        "pre_grasp_approach": _translation(palm, way_in, length, min(least, length)),
        "post_grasp_retreat": _retreat(export, grasp),
        "post_place_retreat": _translation(palm, -way_in, length, min(least, length)),
        "max_contact_force": NO_LIMIT,
        "allowed_touch_objects": [export.object_name, *_touchable_supports(export)],
    }


def _retreat(export: Export, grasp: ExportedGrasp) -> dict[str, Any]:
    """The way out that was planned, in the scene's frame; upwards where none was."""
    scene, way = export.result.scene, export.result.grasp(grasp.rank).retreat_path
    if scene is None or way is None:
        return _translation(LIFT_FRAME, np.array([0.0, 0.0, 1.0]), LIFT, MIN_LIFT)
    least = _approach(export).get("retreat", {}).get("min_distance", MIN_LIFT)
    return _translation(scene.frame, np.array(way.direction_in_world), way.distance, min(least, way.distance))


def _approach(export: Export) -> dict[str, Any]:
    """What was asked of the approach."""
    asked: dict[str, Any] = (export.result.provenance.constraints or {}).get("approach") or {}
    return asked


def _touchable_supports(export: Export) -> list[str]:
    """Support surfaces that fingers may touch."""
    scene = (export.result.provenance.constraints or {}).get("scene") or {}
    return [one["id"] for one in scene.get("support_surfaces", []) if one.get("allow_finger_contact")]


def _posture(export: Export, joints: NDArray[np.float64]) -> dict[str, Any]:
    """trajectory_msgs/JointTrajectory of one point."""
    point = {
        "positions": joints.tolist(),
        "velocities": [],
        "accelerations": [],
        "effort": [],
        "time_from_start": {"sec": 0, "nanosec": 0},
    }
    return {"header": _header(""), "joint_names": list(export.hand.joint_names), "points": [point]}


def _translation(frame: str, direction: NDArray[np.float64], desired: float, least: float) -> dict[str, Any]:
    """moveit_msgs/GripperTranslation."""
    vector = {"header": _header(frame), "vector": _xyz(direction)}
    return {"direction": vector, "desired_distance": desired, "min_distance": least}


def _header(frame: str) -> dict[str, Any]:
    return {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame}


def _xyz(vector: NDArray[np.float64]) -> dict[str, float]:
    return dict(zip("xyz", vector.tolist(), strict=True))


MOVEIT = FileFormat("moveit", "moveit_msgs/Grasp messages, JSON", "json", write=_write)
MOVEIT_YAML = FileFormat("moveit_yaml", "moveit_msgs/Grasp messages, YAML", "yaml", write=_write)
