"""Numbers of a file, checked once for all formats."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import FormatError

__all__ = ["RIGID", "check_count", "numbers", "one_scale", "transforms"]

MAX_GRASPS = 100_000
"""Grasps that one file may list."""
RIGID = 1e-2
"""Most that the columns of a rotation may miss unit length and right angles."""


def check_count(count: int) -> None:
    """Refuse a file that lists no grasp, or too many.

    Raises:
        FormatError: Such a file.
    """
    if not 1 <= count <= MAX_GRASPS:
        raise FormatError(f"The file lists {count:,} grasps; allowed: 1 to {MAX_GRASPS:,}.")


def numbers(value: object, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Finite numbers of a shape, of which None entries may be any length.

    Raises:
        FormatError: Not numbers, another shape, or not finite.
    """
    try:
        given = np.array(value)
        if given.dtype.kind in "SU":
            raise ValueError("These are texts.")
        array = given.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise FormatError(f"{name} must be numbers in rows of one length.") from error
    wanted = "x".join("n" if size is None else str(size) for size in shape) or "one number"
    fits = array.ndim == len(shape) and all(
        size is None or size == got for size, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise FormatError(f"{name} has the shape {array.shape}; it must be {wanted}.")
    if not np.isfinite(array).all():
        raise FormatError(f"{name} holds numbers that are not finite.")
    return array


def one_scale(value: object, name: str) -> float:
    """The factor on a mesh: a number, or three equal ones along the axes; 1 where there is none.

    Raises:
        FormatError: Not a number, or different along the axes.
    """
    if value is None:
        return 1.0
    along = np.ravel(np.asarray(value, dtype=object))
    if len(along) == 3 and along[0] == along[1] == along[2]:
        value = along[0]
    return float(numbers(value, name, ()))


def transforms(value: object, name: str) -> NDArray[np.float64]:
    """Rigid transforms (n, 4, 4).

    Raises:
        FormatError: They are none, or too many.
    """
    if np.size(np.asarray(value, dtype=object)) == 0:
        check_count(0)
    poses = numbers(value, name, (None, 4, 4))
    check_count(len(poses))
    gram = np.swapaxes(poses[:, :3, :3], 1, 2) @ poses[:, :3, :3]
    bad = np.abs(gram - np.eye(3)).max(axis=(1, 2)) > RIGID
    if bad.any():
        raise FormatError(
            f"{name}[{np.argmax(bad)}] is no rigid transform: its rotation's columns are not unit vectors at right "
            f"angles."
        )
    mirrored = np.linalg.det(poses[:, :3, :3]) < 0
    if mirrored.any():
        raise FormatError(f"{name}[{np.argmax(mirrored)}] is no rigid transform: it mirrors, with determinant -1.")
    return poses
