"""Rotations and poses at the package's boundary.

Conventions: ``a_from_b`` maps coordinates in frame b to coordinates in frame a, so ``a_from_b @ b_from_c`` is
``a_from_c``. Quaternions are ``wxyz`` with w >= 0. Lengths [m], angles [rad].
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

__all__ = [
    "euler_xyz_from_rotation",
    "pose_matrix",
    "rotation_from_wxyz",
    "rotation_to_axis",
    "transform_points",
    "wxyz_from_rotation",
]


def wxyz_from_rotation(rotation: ArrayLike) -> NDArray[np.float64]:
    """Unit quaternion (4,) with w >= 0 of a rotation matrix (3, 3)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.asarray(rotation, dtype=np.float64).tolist()
    # Each row is the quaternion times four times one of its components; the largest loses least to rounding.
    multiples = (
        (1 + xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, 1 + xx - yy - zz, xy + yx, xz + zx),
        (xz - zx, xy + yx, 1 - xx + yy - zz, yz + zy),
        (yx - xy, xz + zx, yz + zy, 1 - xx - yy + zz),
    )
    largest = max(range(4), key=lambda i: multiples[i][i])
    quaternion = np.array(multiples[largest])
    return quaternion / math.copysign(math.sqrt(quaternion @ quaternion), quaternion[0])


def rotation_from_wxyz(wxyz: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) of a quaternion (4,), which need not be of unit length."""
    return np.asarray(Rotation.from_quat(np.asarray(wxyz), scalar_first=True).as_matrix())


def euler_xyz_from_rotation(rotation: ArrayLike) -> NDArray[np.float64]:
    """Angles (3,) [rad] of turns about the fixed x, then y, then z axis that make up a rotation matrix (3, 3)."""
    return np.asarray(Rotation.from_matrix(np.asarray(rotation)).as_euler("xyz"))


def rotation_to_axis(axis: ArrayLike) -> NDArray[np.float64]:
    """A rotation (3, 3) that turns z into the direction ``axis`` (3,)."""
    z = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def pose_matrix(rotation: ArrayLike, position: ArrayLike) -> NDArray[np.float64]:
    """Homogeneous transform (4, 4) of a rotation (3, 3) and a position (3,) [m]."""
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = position
    return pose


def transform_points(a_from_b: ArrayLike, points_in_b: ArrayLike) -> NDArray[np.float64]:
    """Points (..., 3) [m] of frame b in frame a."""
    a_from_b = np.asarray(a_from_b)
    return np.asarray(points_in_b @ a_from_b[:3, :3].T + a_from_b[:3, 3])
