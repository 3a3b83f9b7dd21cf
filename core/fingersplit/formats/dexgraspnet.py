"""DexGraspNet files: a pickled list of grasps, palm as translation and Euler angles among the joints."""

from typing import Any

from fingersplit.formats.exporting import Export
from fingersplit.formats.file_format import FileFormat
from fingersplit.transforms import euler_xyz_from_rotation

__all__ = ["DEXGRASPNET", "ROTATION", "TRANSLATION"]

TRANSLATION, ROTATION = ("WRJTx", "WRJTy", "WRJTz"), ("WRJRx", "WRJRy", "WRJRz")


def _write(export: Export) -> list[dict[str, Any]]:
    """A list of ``{scale, qpos}``; Euler angles turn about the object frame's x, then y, then z axis [rad].

    ``scale`` is 1: the object's mesh is in metres already. The first row has the origin of all.
    """
    rows = list[dict[str, Any]]()
    for grasp in export.grasps:
        angles = euler_xyz_from_rotation(grasp.pose.object_from_palm[:3, :3])
        qpos = {
            **dict(zip(TRANSLATION, grasp.pose.position.tolist(), strict=True)),
            **dict(zip(ROTATION, angles.tolist(), strict=True)),
            **export.hand.named(grasp.pose.joints),
        }
        rows.append({"scale": 1.0, "qpos": qpos, "fingersplit": export.origin if not rows else {"rank": grasp.rank}})
    return rows


DEXGRASPNET = FileFormat("dexgraspnet", "DexGraspNet .npy", "npy", write=_write)
