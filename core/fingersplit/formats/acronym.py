"""ACRONYM and GraspGen: poses of a Franka Panda gripper with the outcome of a simulation, as HDF5 and as JSON."""

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ParallelGraspError
from fingersplit.formats.jaw_poses import JawPoses, check_transforms, numbers

__all__ = ["read_acronym", "read_graspgen", "recognises_acronym", "recognises_graspgen"]

OPENING = 0.082
"""Between the open fingers, which stand at x = +-0.041 m."""
PANDA_NAMES = ("panda", "franka")


def recognises_acronym(file: h5py.File) -> bool:
    """Whether an HDF5 file lists gripper poses as ACRONYM does."""
    return "grasps/transforms" in file


def read_acronym(file: h5py.File, _object_name: str) -> JawPoses:
    """Poses of the gripper in the frame of the scaled mesh; those that dropped the object are known to fail."""
    _check_gripper(_scalar(file, "gripper/type"))
    transforms = check_transforms(_dataset(file, "grasps/transforms"), "grasps/transforms")
    held = np.ones(len(transforms))
    if "grasps/qualities/flex/object_in_gripper" in file:
        held = numbers(
            _dataset(file, "grasps/qualities/flex/object_in_gripper"), "object_in_gripper", (len(transforms),)
        )
    return _poses(transforms, held, _scalar(file, "object/scale"))


def recognises_graspgen(document: Any) -> bool:
    """Whether a JSON document lists gripper poses as GraspGen does."""
    grasps = document.get("grasps") if isinstance(document, dict) else None
    return isinstance(grasps, dict) and "transforms" in grasps


def read_graspgen(document: Any, _object_name: str) -> JawPoses:
    """The same from GraspGen; where it names a gripper, that must be the Panda."""
    gripper = document.get("gripper")
    _check_gripper(gripper.get("name", gripper.get("type")) if isinstance(gripper, dict) else gripper)
    transforms = check_transforms(document["grasps"]["transforms"], "grasps.transforms")
    held = document["grasps"].get("object_in_gripper", [1] * len(transforms))
    scale = document["object"].get("scale") if isinstance(document.get("object"), dict) else None
    return _poses(transforms, numbers(held, "grasps.object_in_gripper", (len(transforms),)), scale)


def _poses(transforms: NDArray[np.float64], held: NDArray[np.float64], scale: Any) -> JawPoses:
    hint = "" if scale is None else f"The grasps belong to the mesh times the file's object scale of {scale}."
    return JawPoses.of_panda(transforms, np.where(held > 0, 1.0, -1.0), opening=OPENING, closing=0, hint=hint)


def _check_gripper(name: Any) -> None:
    if name is not None and not any(known in str(name).lower() for known in PANDA_NAMES):
        raise ParallelGraspError(
            f"The grasps are for the gripper {name!r}, whose fingers are not known here; "
            f"known: {', '.join(PANDA_NAMES)}."
        )


def _dataset(file: h5py.File, name: str) -> NDArray[Any]:
    entry = file[name]
    if not isinstance(entry, h5py.Dataset):
        raise ParallelGraspError(f"{name} of the HDF5 file is no dataset.")
    try:
        return np.asarray(entry[()])
    except (OSError, ValueError, MemoryError) as error:
        raise ParallelGraspError(f"{name} of the HDF5 file cannot be read: {error}.") from error


def _scalar(file: h5py.File, name: str) -> Any:
    """A text or a number, None where the file has none."""
    if name not in file:
        return None
    value = _dataset(file, name).item()
    return value.decode(errors="replace") if isinstance(value, bytes) else value
