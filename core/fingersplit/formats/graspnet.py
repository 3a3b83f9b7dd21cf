"""graspnetAPI arrays: 17 numbers a grasp."""

from typing import Any

import numpy as np

from fingersplit.errors import FormatError
from fingersplit.formats.fields import RIGID, check_count, numbers
from fingersplit.formats.file_format import FileFormat, Request
from fingersplit.formats.grippers import JawPoses

__all__ = ["GRASPNET"]

COLUMNS = 17


def _recognises(content: Any) -> bool:
    """Every .npy file of numbers is taken for one; reading it says what is wrong."""
    return isinstance(content, np.ndarray)


def _read(content: Any, request: Request) -> JawPoses:
    """Grasps of one object: score, width, height, depth, rotation (approach, closing, lateral), position, object.

    The pads reach from the gripper's origin to ``depth`` along the approach and are ``height`` wide.
    """
    if not isinstance(content, np.ndarray):
        raise FormatError("The file is no .npy array of numbers.")
    rows = numbers(np.atleast_2d(content), "graspnetAPI array", (None, COLUMNS))
    check_count(len(rows))
    if len(np.unique(rows[:, 16])) > 1:
        raise FormatError(
            f"The array holds grasps of {len(np.unique(rows[:, 16]))} objects in the frame of their scene; "
            f"keep the rows of one object, in its frame."
        )
    width, height, depth = request.scale * rows[:, 1:4].T
    rotations = rows[:, 4:13].reshape(-1, 3, 3)
    skew = np.abs(np.swapaxes(rotations, 1, 2) @ rotations - np.eye(3)).max(axis=(1, 2))
    if (width <= 0).any() or (rows[:, 2:4] < 0).any() or (skew > RIGID).any():
        raise FormatError("Every row needs a positive width, no negative height or depth, and a rotation.")
    approaches = rotations[:, :, 0]
    return JawPoses(
        centers=request.scale * rows[:, 13:16] + 0.5 * depth[:, None] * approaches,
        axes=rotations[:, :, 1],
        approaches=approaches,
        openings=width,
        pads=np.stack([height, depth], axis=1),
        scores=rows[:, 0] - min(rows[:, 0].min(), 0.0),
        hint="The grasps must be in the frame of the mesh, not of a camera.",
    )


GRASPNET = FileFormat("graspnet", "graspnetAPI .npy", "npy", _recognises, read_parallel=_read)
