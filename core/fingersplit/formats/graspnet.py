"""graspnetAPI arrays: 17 numbers a grasp."""

import io

import numpy as np

from fingersplit.errors import ParallelGraspError
from fingersplit.formats.jaw_poses import RIGID, JawPoses, check_count, numbers

__all__ = ["read_graspnet", "recognises_graspnet"]

COLUMNS = 17


def recognises_graspnet(data: bytes) -> bool:
    """Every .npy file is taken for one; reading it says what is wrong."""
    return data.startswith(b"\x93NUMPY")


def read_graspnet(data: bytes, _object_name: str) -> JawPoses:
    """Grasps of one object: score, width, height, depth, rotation (approach, closing, lateral), position, object.

    The pads reach from the gripper's origin to ``depth`` along the approach and are ``height`` wide.
    """
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError, MemoryError) as error:
        raise ParallelGraspError(f"The file is no .npy array of numbers: {error}.") from error
    rows = numbers(np.atleast_2d(array), "graspnetAPI array", (None, COLUMNS))
    check_count(len(rows))
    if len(np.unique(rows[:, 16])) > 1:
        raise ParallelGraspError(
            f"The array holds grasps of {len(np.unique(rows[:, 16]))} objects in the frame of their scene; "
            f"keep the rows of one object, in its frame."
        )
    width, height, depth = rows[:, 1], rows[:, 2], rows[:, 3]
    rotations = rows[:, 4:13].reshape(-1, 3, 3)
    skew = np.abs(np.swapaxes(rotations, 1, 2) @ rotations - np.eye(3)).max(axis=(1, 2))
    if (width <= 0).any() or (rows[:, 2:4] < 0).any() or (skew > RIGID).any():
        raise ParallelGraspError("Every row needs a positive width, no negative height or depth, and a rotation.")
    approaches = rotations[:, :, 0]
    return JawPoses(
        centers=rows[:, 13:16] + 0.5 * depth[:, None] * approaches,
        axes=rotations[:, :, 1],
        approaches=approaches,
        openings=width,
        pads=np.stack([height, depth], axis=1),
        scores=rows[:, 0] - min(rows[:, 0].min(), 0.0),
        hint="The grasps must be in the frame of the mesh, not of a camera.",
    )
