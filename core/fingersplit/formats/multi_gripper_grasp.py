"""MultiGripperGrasp files: JSON with one gripper, one object, poses and joint values side by side."""

from typing import Any

from fingersplit.formats.exporting import Export
from fingersplit.formats.file_format import FileFormat

__all__ = ["MULTI_GRIPPER_GRASP"]


def _write(export: Export) -> dict[str, Any]:
    """``gripper, object_ID, pose`` (xyz [m], wxyz; palm in the object frame) and ``dofs`` [rad], one row a grasp."""
    return {
        "gripper": export.hand.name,
        "object_ID": export.object_name,
        "pose": [[*grasp.pose.position.tolist(), *grasp.pose.wxyz.tolist()] for grasp in export.grasps],
        "dofs": [grasp.pose.joints.tolist() for grasp in export.grasps],
        "fingersplit": export.origin,
    }


MULTI_GRIPPER_GRASP = FileFormat("multi_gripper_grasp", "MultiGripperGrasp JSON", "json", write=_write)
