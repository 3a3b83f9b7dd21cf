"""GraspGen and ACRONYM: poses of a gripper with the outcome of a simulation, also of grasps that failed."""

import json
from pathlib import Path

import numpy as np

from fingersplit.dataset.layouts.layout import ConvertedObject, Layout
from fingersplit.extras import extra

__all__ = ["ACRONYM", "GRASPGEN"]


def _write_graspgen(folder: Path, made: ConvertedObject) -> list[Path]:
    """``grasps/<object>.json``: the gripper's frame is at the palm's origin, z approaches and x closes."""
    document = {
        "object": {"file": made.item.file, "scale": made.object_scale},
        "gripper": {"name": made.shard.hand["name"]},
        "grasps": {
            "transforms": made.object_from_jaws().tolist(),
            "object_in_gripper": made.good.astype(int).tolist(),
            "joints": made.column("joints").tolist(),
        },
        "fingersplit": made.origin(),
    }
    path = folder / "grasps" / f"{made.item.label}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(document))
    return [path]


def _write_acronym(folder: Path, made: ConvertedObject) -> list[Path]:
    """``grasps/<object>.h5`` with ACRONYM's entries; joints stand beside the poses."""
    with extra("formats"):
        import h5py
    planned = made.shard.object
    scale = made.object_scale
    path = folder / "grasps" / f"{made.item.label}.h5"
    path.parent.mkdir(exist_ok=True)
    with h5py.File(path, "w") as file:
        file["grasps/transforms"] = made.object_from_jaws()
        file["grasps/joints"] = made.column("joints")
        file["grasps/qualities/flex/object_in_gripper"] = made.good.astype(np.int64)
        file["gripper/type"] = made.shard.hand["name"]
        file["gripper/configuration"] = made.column("joints")[:1].ravel()
        file["object/file"] = made.item.file
        file["object/scale"] = scale
        file["object/mass"] = planned["mass"]
        file["object/com"] = np.array(planned["center_of_mass"])
        file["object/inertia"] = np.array(planned["inertia"])
        file["object/friction"] = planned["friction"]
        file["object/volume"] = planned["volume"]
        file["object/density"] = planned["mass"] / planned["volume"] if planned["volume"] > 0 else np.nan
        file.attrs["fingersplit"] = json.dumps(made.origin())
    return [path]


GRASPGEN = Layout("graspgen", "GraspGen: gripper poses with outcomes, JSON", _write_graspgen, failures=True)
ACRONYM = Layout("acronym", "ACRONYM-like: gripper poses with outcomes, HDF5", _write_acronym, failures=True)
