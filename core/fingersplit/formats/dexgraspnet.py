"""DexGraspNet files: a pickled list of grasps, palm as translation and Euler angles among the joints."""

from fingersplit.formats.pickled_npy import dump_npy
from fingersplit.formats.results import Results
from fingersplit.transforms import euler_xyz_from_rotation

__all__ = ["write_dexgraspnet"]

TRANSLATION, ROTATION = ("WRJTx", "WRJTy", "WRJTz"), ("WRJRx", "WRJRy", "WRJRz")


def write_dexgraspnet(results: Results) -> bytes:
    """A list of ``{scale, qpos}``; Euler angles turn about the object frame's x, then y, then z axis [rad].

    ``scale`` is 1: the object's mesh is in metres already.
    """
    rows = []
    for grasp in results.grasps:
        angles = euler_xyz_from_rotation(grasp.grasp.object_from_palm[:3, :3])
        qpos = {
            **dict(zip(TRANSLATION, grasp.grasp.position.tolist(), strict=True)),
            **dict(zip(ROTATION, angles.tolist(), strict=True)),
            **results.hand.named(grasp.grasp.joints),
        }
        rows.append({"scale": 1.0, "qpos": qpos, "fingersplit": results.provenance})
    return dump_npy(rows)
