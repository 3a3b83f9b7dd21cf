"""BODex: one .npy an object with all configurations of the hand; Dexonomy: one .npy a grasp."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.dataset.layouts.layout import ConvertedObject, Layout
from fingersplit.formats.pickled_npy import dump_npy

__all__ = ["BODEX", "DEXONOMY"]

ORIGIN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Object in the world: xyz and wxyz."""


def _write_bodex(folder: Path, made: ConvertedObject) -> list[Path]:
    """``<object>/scale<1000 x scale>_grasp.npy``: ``robot_pose`` (1, n, 3, 7 + J) is pre-grasp, grasp and squeeze."""
    configurations = np.stack(list(_configurations(made).values()), axis=1)
    scale = made.object_scale
    sample = {
        "robot_pose": configurations[None],
        "joint_names": made.joint_names,
        "obj_pose": np.array([ORIGIN]),
        "obj_scale": np.array([scale]),
        "obj_code": made.item.label,
        "fingersplit": made.origin(),
    }
    path = folder / made.item.label / f"scale{round(1000 * scale):04d}_grasp.npy"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(dump_npy(sample))
    return [path]


def _write_dexonomy(folder: Path, made: ConvertedObject) -> list[Path]:
    """``<object>/<rank>.npy``: ``pregrasp_qpos``, ``grasp_qpos`` and ``squeeze_qpos`` (1, 7 + J), and the scene."""
    place = folder / made.item.label
    place.mkdir(exist_ok=True)
    scene = {
        "scene": {
            made.item.name: {
                "type": "rigid_object",
                "file_path": made.item.file,
                "scale": np.full(3, made.object_scale),
                "pose": np.array(ORIGIN),
            }
        },
        "task": {"type": "force_closure", "obj_name": made.item.name},
    }
    written = []
    parts = {f"{name}_qpos": values for name, values in _configurations(made).items()}
    contacts, links = made.column("contact_position"), made.shard.hand["contact_links"]
    normals = made.column("contact_normal")
    for row in range(len(made.rows)):
        sample: dict[str, Any] = {name: values[row : row + 1] for name, values in parts.items()}
        sample |= {
            "hand_name": made.shard.hand["name"],
            "joint_names": made.joint_names,
            "scene_cfg": scene,
            "obj_cpn_w": np.concatenate([contacts[row], -normals[row]], axis=1),
            "hand_cbody": list(links),
            "fingersplit": made.origin() | {"grasp_ids": [str(made.column("id")[row])]},
        }
        path = place / f"{row:06d}.npy"
        path.write_bytes(dump_npy(sample))
        written.append(path)
    return written


def _configurations(made: ConvertedObject) -> dict[str, NDArray[np.float64]]:
    """Hand before the fingers close, on the object, and as position servos aim, each (n, 7 + J)."""
    return {
        "pregrasp": made.qpos("pregrasp_joints", before=True),
        "grasp": made.qpos(),
        "squeeze": made.qpos("squeeze_joints"),
    }


BODEX = Layout("bodex", "BODex: robot_pose of all grasps of an object, .npy", _write_bodex, free_way=True)
DEXONOMY = Layout(
    "dexonomy", "Dexonomy: one .npy a grasp with pre-grasp, grasp and squeeze", _write_dexonomy, free_way=True
)
