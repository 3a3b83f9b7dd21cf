"""Open grippers as the formats give them, before their jaws are closed on the object."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ParallelGraspError

__all__ = ["PANDA_PAD", "JawPoses", "check_count", "check_transforms", "numbers"]

MAX_GRASPS = 100_000
"""Grasps that one file may list."""
PANDA_PAD = (0.018, 0.018)
"""Lateral width of a Franka Panda's pads and their length along the approach [m]."""
PANDA_DEPTH = 0.103
"""From the Panda's hand frame to the middle of its pads, along the approach [m]."""
RIGID = 1e-2
"""Most that the columns of a rotation may miss unit length and right angles."""


@dataclass(frozen=True, eq=False)
class JawPoses:
    """Grippers about the object, in its frame.

    Attributes:
        centers: Midway between the open pads, (n, 3) [m].
        axes: Unit direction along which the jaws close, (n, 3).
        approaches: Unit direction of travel towards the object, (n, 3).
        openings: Distance of the open pads, (n,) [m].
        pads: Lateral width of the pads and their length along the approach, (n, 2) [m].
        scores: Larger is better, (n,); below zero for a grasp that is known to fail.
        hint: What to check when no jaw meets the object, a sentence.
    """

    centers: NDArray[np.float64]
    axes: NDArray[np.float64]
    approaches: NDArray[np.float64]
    openings: NDArray[np.float64]
    pads: NDArray[np.float64]
    scores: NDArray[np.float64]
    hint: str = ""

    @classmethod
    def of_panda(
        cls,
        object_from_gripper: NDArray[np.float64],
        scores: NDArray[np.float64],
        *,
        opening: float | NDArray[np.float64],
        closing: int,
        hint: str = "",
    ) -> Self:
        """Franka Panda grippers from poses (n, 4, 4) whose z is the approach; jaws close along column ``closing``."""
        count, rotations = len(object_from_gripper), object_from_gripper[:, :3, :3]
        return cls(
            centers=object_from_gripper[:, :3, 3] + PANDA_DEPTH * rotations[:, :, 2],
            axes=rotations[:, :, closing],
            approaches=rotations[:, :, 2],
            openings=np.broadcast_to(np.asarray(opening, dtype=np.float64), (count,)).copy(),
            pads=np.tile(PANDA_PAD, (count, 1)),
            scores=scores,
            hint=hint,
        )


def check_count(count: int) -> None:
    """Refuse a file that lists no grasp, or too many."""
    if not 1 <= count <= MAX_GRASPS:
        raise ParallelGraspError(f"The file lists {count} grasps; allowed: 1 to {MAX_GRASPS}.")


def check_transforms(value: object, name: str) -> NDArray[np.float64]:
    """Rigid transforms (n, 4, 4), refused when they are none."""
    poses = numbers(value, name, (None, 4, 4))
    check_count(len(poses))
    gram = np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3]
    bad = np.abs(gram - np.eye(3)).max(axis=(1, 2)) > RIGID
    if bad.any():
        raise ParallelGraspError(
            f"{name}[{np.argmax(bad)}] is no rigid transform: its rotation's columns are not unit vectors at right "
            f"angles."
        )
    return poses


def numbers(value: object, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Finite numbers of a shape, of which None entries may be any length.

    Raises:
        ParallelGraspError: Not numbers, another shape, or not finite.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ParallelGraspError(f"{name} must be numbers: {error}.") from error
    wanted = "x".join("n" if size is None else str(size) for size in shape) or "one number"
    fits = array.ndim == len(shape) and all(
        size is None or size == got for size, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise ParallelGraspError(f"{name} has the shape {array.shape}; it must be {wanted}.")
    if not np.isfinite(array).all():
        raise ParallelGraspError(f"{name} holds numbers that are not finite.")
    return array
