"""Isaac grasp files of parallel grippers: the file names the gripper's frame, the frame tells how its jaws close."""

import numpy as np

from fingersplit.errors import ExchangeError, ParallelGraspError
from fingersplit.formats.isaac_grasp import read_isaac_grasp
from fingersplit.formats.jaw_poses import JawPoses, check_count

__all__ = ["read_isaac", "recognises_isaac"]

PANDA_FRAMES = ("panda_hand", "fr3_hand", "franka_hand")
"""Frames of the Franka hands: z is the approach, the fingers close along y."""
MAX_OPEN = 0.08
"""Between the fingers of an open Franka hand [m]."""


def recognises_isaac(data: bytes) -> bool:
    """Whether a YAML file says that it is an Isaac grasp file."""
    return b"isaac_grasp" in data[:1000]


def read_isaac(data: bytes, _object_name: str) -> JawPoses:
    """Poses of the gripper in the object frame, opened fully, best confidence first."""
    try:
        file = read_isaac_grasp(data)
    except ExchangeError as error:
        raise ParallelGraspError(str(error)) from error
    frame = file.gripper_frame.rsplit("/", 1)[-1]
    if frame not in PANDA_FRAMES:
        raise ParallelGraspError(
            f"The gripper frame {file.gripper_frame!r} is not known here, so neither is how its jaws close; "
            f"known: {', '.join(PANDA_FRAMES)}."
        )
    check_count(len(file.grasps))
    return JawPoses.of_panda(
        np.array([grasp.object_from_gripper for grasp in file.grasps]),
        np.array([max(grasp.confidence, 0.0) for grasp in file.grasps]),
        opening=MAX_OPEN,
        closing=1,
        hint=f"Poses are in the frame {file.object_frame!r}, which must be the mesh's.",
    )
