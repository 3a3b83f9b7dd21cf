"""MultiGripperGrasp: one JSON for each pair of gripper and object, poses and joint values side by side."""

import json
from pathlib import Path

from fingersplit.dataset.layouts.layout import ConvertedObject, Layout

__all__ = ["MULTI_GRIPPER_GRASP"]


def _write(folder: Path, made: ConvertedObject) -> list[Path]:
    """``<gripper>/<gripper>-<object>.json``: pose is xyz [m] and wxyz of the palm in the object frame."""
    hand = made.shard.hand["name"]
    document = {
        "gripper": hand,
        "object_ID": made.item.label,
        "pose": made.qpos()[:, :7].tolist(),
        "dofs": made.column("joints").tolist(),
        "fingersplit": made.origin(),
    }
    path = folder / hand / f"{hand}-{made.item.label}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(document))
    return [path]


MULTI_GRIPPER_GRASP = Layout("multi_gripper_grasp", "MultiGripperGrasp: poses and dofs of an object, JSON", _write)
