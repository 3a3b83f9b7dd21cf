"""DexGraspNet: one .npy an object, a list of grasps with palm as translation and Euler angles among the joints."""

from pathlib import Path

import numpy as np

from fingersplit.dataset.layouts.layout import ConvertedObject, Layout
from fingersplit.formats.dexgraspnet import ROTATION, TRANSLATION
from fingersplit.formats.pickled_npy import dump_npy
from fingersplit.transforms import euler_xyz_from_rotation

__all__ = ["DEXGRASPNET"]


def _write(folder: Path, made: ConvertedObject) -> list[Path]:
    """``dataset/<object>.npy``; ``scale`` makes metres of the object's file, angles turn about x, then y, then z."""
    rows = []
    for pose, joints, grasp_id in zip(made.object_from_palm(), made.column("joints"), made.column("id"), strict=True):
        angles = euler_xyz_from_rotation(pose[:3, :3])
        qpos = {
            **dict(zip(TRANSLATION, pose[:3, 3].tolist(), strict=True)),
            **dict(zip(ROTATION, np.asarray(angles).tolist(), strict=True)),
            **dict(zip(made.joint_names, joints.tolist(), strict=True)),
        }
        rows.append({"scale": made.object_scale, "qpos": qpos, "id": str(grasp_id)})
    path = folder / "dataset" / f"{made.item.label}.npy"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(dump_npy(rows))
    return [path]


DEXGRASPNET = Layout("dexgraspnet", "DexGraspNet: a list of {scale, qpos} an object, .npy", _write)
