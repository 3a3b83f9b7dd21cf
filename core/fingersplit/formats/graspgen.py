"""GraspGen: poses of a gripper with the outcome of a simulation, as JSON."""

from typing import Any

from fingersplit.formats.acronym import poses_with_outcome
from fingersplit.formats.fields import numbers, transforms
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.formats.grippers import JawPoses

__all__ = ["GRASPGEN"]


def _recognises(document: Any) -> bool:
    grasps = document.get("grasps") if isinstance(document, dict) else None
    return isinstance(grasps, dict) and "transforms" in grasps


def _read(document: Any, request: Request) -> JawPoses:
    """As ACRONYM's; where the file names no gripper, it is the Panda."""
    gripper = document.get("gripper")
    if isinstance(gripper, dict):
        gripper = gripper.get("name", gripper.get("type"))
    poses = transforms(document["grasps"]["transforms"], "grasps.transforms")
    held = document["grasps"].get("object_in_gripper", [1] * len(poses))
    held = numbers(held, "grasps.object_in_gripper", (len(poses),))
    scale = document["object"].get("scale") if isinstance(document.get("object"), dict) else None
    return poses_with_outcome(poses, held, gripper, scale, request)


GRASPGEN = FileFormat("graspgen", "GraspGen JSON", "json", _recognises, read_parallel=_read)
