"""moveit_msgs/Grasp messages, field for field, as JSON or YAML."""

import json
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from fingersplit.formats.results import ResultGrasp, Results

__all__ = ["write_moveit_json", "write_moveit_yaml"]

APPROACH, MIN_APPROACH = 0.10, 0.02
"""Wanted and least length of a straight way in where no pre-grasp is known [m]."""
LIFT, MIN_LIFT = 0.10, 0.02
"""Wanted and least height of the lift after the grasp [m]."""
LIFT_FRAME = "world"
"""Frame of the lift, z upwards; the object's own frame says nothing about where up is."""
NO_LIMIT = 0.0
"""``max_contact_force`` that sets no limit."""


def write_moveit_json(results: Results) -> bytes:
    """``{"fingersplit": origin, "grasps": [moveit_msgs/Grasp, ...]}`` as JSON."""
    return (json.dumps(_document(results), indent=2) + "\n").encode()


def write_moveit_yaml(results: Results) -> bytes:
    """The same as YAML."""
    return str(yaml.safe_dump(_document(results), sort_keys=False)).encode()


def _document(results: Results) -> dict[str, Any]:
    return {"fingersplit": results.provenance, "grasps": [_message(results, grasp) for grasp in results.grasps]}


def _message(results: Results, grasp: ResultGrasp) -> dict[str, Any]:
    before = grasp.pregrasp or grasp.grasp
    palm = results.hand.palm
    way_in, length = _way_in(results, grasp)
    return {
        "id": f"grasp_{grasp.rank}",
        "pre_grasp_posture": _posture(results, before.joints),
        "grasp_posture": _posture(results, grasp.squeeze.joints),
        "grasp_pose": {
            "header": _header(results.object_name),
            "pose": {
                "position": _xyz(grasp.grasp.position),
                "orientation": {**_xyz(grasp.grasp.wxyz[1:]), "w": float(grasp.grasp.wxyz[0])},
            },
        },
        "grasp_quality": grasp.confidence,
        "pre_grasp_approach": _translation(palm, way_in, length, min(MIN_APPROACH, length)),
        "post_grasp_retreat": _translation(LIFT_FRAME, np.array([0.0, 0.0, 1.0]), LIFT, MIN_LIFT),
        "post_place_retreat": _translation(palm, -way_in, length, min(MIN_APPROACH, length)),
        "max_contact_force": NO_LIMIT,
        "allowed_touch_objects": [results.object_name],
    }


def _way_in(results: Results, grasp: ResultGrasp) -> tuple[NDArray[np.float64], float]:
    """Direction (3,) in the palm frame and length [m] of the straight way to the grasp."""
    if grasp.pregrasp is not None:
        way = grasp.grasp.position - grasp.pregrasp.position
        length = float(np.linalg.norm(way))
        if length > 0:
            return grasp.grasp.object_from_palm[:3, :3].T @ way / length, length
    return results.hand.gripper.palm_from_gripper[:, 2], APPROACH


def _posture(results: Results, joints: NDArray[np.float64]) -> dict[str, Any]:
    """trajectory_msgs/JointTrajectory of one point."""
    point = {
        "positions": joints.tolist(),
        "velocities": [],
        "accelerations": [],
        "effort": [],
        "time_from_start": {"sec": 0, "nanosec": 0},
    }
    return {"header": _header(""), "joint_names": list(results.hand.joint_names), "points": [point]}


def _translation(frame: str, direction: NDArray[np.float64], desired: float, least: float) -> dict[str, Any]:
    """moveit_msgs/GripperTranslation."""
    vector = {"header": _header(frame), "vector": _xyz(direction)}
    return {"direction": vector, "desired_distance": desired, "min_distance": least}


def _header(frame: str) -> dict[str, Any]:
    return {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame}


def _xyz(vector: NDArray[np.float64]) -> dict[str, float]:
    return dict(zip("xyz", vector.tolist(), strict=True))
