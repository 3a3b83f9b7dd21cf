"""ACRONYM: poses of a Franka Panda gripper with the outcome of a simulation, as HDF5."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError
from fingersplit.formats.fields import numbers, one_scale, transforms
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.formats.grippers import GRIPPERS, JawPoses, gripper_of

__all__ = ["ACRONYM", "poses_with_outcome"]

OPENING = 0.082
"""Between the open fingers, which stand at x = +-0.041 m."""
OUTCOME = "grasps/qualities/flex/object_in_gripper"


def _recognises(file: Any) -> bool:
    return "grasps/transforms" in file


def _read(file: Any, request: Request) -> JawPoses:
    """Poses of the gripper in the frame of the scaled mesh; those that dropped the object are known to fail."""
    poses = transforms(_dataset(file, "grasps/transforms"), "grasps/transforms")
    held = np.ones(len(poses))
    if OUTCOME in file:
        held = numbers(_dataset(file, OUTCOME), "object_in_gripper", (len(poses),))
    return poses_with_outcome(poses, held, _scalar(file, "gripper/type"), _scalar(file, "object/scale"), request)


def poses_with_outcome(
    poses: NDArray[np.float64], held: NDArray[np.float64], gripper: object, scale: object, request: Request
) -> JawPoses:
    """Grippers that close along x and held or dropped the object, as ACRONYM and GraspGen list them."""
    return JawPoses.of_gripper(
        gripper_of(gripper, request.gripper) or GRIPPERS["panda"],
        poses,
        np.where(held > 0, 1.0, -1.0),
        closing=0,
        opening=OPENING,
        scale=request.scale,
        object_scale=one_scale(scale, "object scale"),
    )


def _dataset(file: Any, name: str) -> NDArray[Any]:
    entry = file[name]
    if not hasattr(entry, "shape"):
        raise FormatError(f"{name} of the HDF5 file is no dataset.")
    try:
        return np.asarray(entry[()])
    except (OSError, ValueError, MemoryError) as error:
        raise FormatError(f"{name} of the HDF5 file cannot be read; the file is damaged.") from error


def _scalar(file: Any, name: str) -> Any:
    """A text or a number, None where the file has none."""
    if name not in file:
        return None
    value = _dataset(file, name)
    if value.size != 1:
        raise FormatError(f"{name} of the HDF5 file must be one value.")
    return value.item().decode(errors="replace") if isinstance(value.item(), bytes) else value.item()


ACRONYM = FileFormat("acronym", "ACRONYM HDF5", "hdf5", _recognises, read_parallel=_read)
