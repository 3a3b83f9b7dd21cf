"""What a depth camera saw of a scene: an image of points, and which of them are the object to grasp."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import SceneError

__all__ = ["MAX_PIXELS", "View"]

MAX_PIXELS = 8_000_000
MILLIMETRES = 1e-3
"""[m]; what a depth image of whole numbers counts, as the cameras of most makers do."""
FARTHEST = 100.0
"""[m]; what a camera claims to have seen beyond is no measurement."""


@dataclass(frozen=True, eq=False)
class View:
    """One image of a depth camera, in the camera's optical frame: x right, y down, z along the view.

    Attributes:
        points: What every pixel shows, (h, w, 3) [m]; not finite where nothing was measured.
        mask: Pixels of the object to grasp, (h, w).
        world_from_camera: Pose of the camera, (4, 4); None where it is not known.
    """

    points: NDArray[np.float64]
    mask: NDArray[np.bool_]
    world_from_camera: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        points = np.array(_numbers("points", self.points))
        if points.ndim != 3 or points.shape[2] != 3:
            raise SceneError("points", f"must be an organised cloud (height, width, 3), got {points.shape}.")
        if not 0 < points.shape[0] * points.shape[1] <= MAX_PIXELS:
            raise SceneError("points", f"are an image of {points.shape[:2]}; allowed: 1 to {MAX_PIXELS:,} pixels.")
        mask = np.array(self.mask)
        mask = mask[..., 0] if mask.ndim == 3 else mask  # an image of colours
        if mask.shape != points.shape[:2]:
            raise SceneError("mask", f"has the size {mask.shape}, the image {points.shape[:2]}; they must agree.")
        points[~(np.abs(points) <= FARTHEST).all(axis=2)] = np.nan
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "mask", mask.astype(bool))
        if self.world_from_camera is not None:
            pose = _numbers("camera_pose", self.world_from_camera)
            if pose.shape != (4, 4) or not _is_rigid(pose):
                raise SceneError("camera_pose", "must be a matrix (4, 4) of a rotation and a translation [m].")
            object.__setattr__(self, "world_from_camera", pose)

    @classmethod
    def from_depth(
        cls,
        depth: ArrayLike,
        mask: ArrayLike,
        intrinsics: ArrayLike,
        *,
        depth_scale: float | None = None,
        world_from_camera: ArrayLike | None = None,
    ) -> Self:
        """From a depth image: distance along the view at every pixel; 0 or not finite where nothing was measured.

        Args:
            depth: (h, w); metres, or millimetres if they are whole numbers.
            mask: Pixels of the object, (h, w); all but 0 count.
            intrinsics: ``[fx, fy, cx, cy]`` in pixels, or the camera matrix (3, 3); without distortion.
            depth_scale: Metres of one unit of ``depth``, in place of what its type says.
            world_from_camera: Pose of the camera, (4, 4).

        Raises:
            SceneError: Sizes that do not agree, or numbers that are none.
        """
        given = np.asarray(depth)
        if given.ndim != 2:
            raise SceneError("depth", f"must be an image (height, width), got {given.shape}.")
        fx, fy, cx, cy = _intrinsics(intrinsics)
        if depth_scale is None:
            depth_scale = MILLIMETRES if given.dtype.kind in "iu" else 1.0
        if not 0.0 < depth_scale < 100.0:
            raise SceneError("depth_scale", f"is {depth_scale!r}; it must be metres of one unit, such as 0.001.")
        z = _numbers("depth", given) * depth_scale
        z[~(z > 0.0)] = np.nan
        rows, columns = np.indices(z.shape)
        points = np.stack([(columns - cx) / fx * z, (rows - cy) / fy * z, z], axis=2)
        return cls(points, np.asarray(mask), None if world_from_camera is None else np.asarray(world_from_camera))


def _is_rigid(pose: NDArray[np.float64]) -> bool:
    """Whether a finite matrix (4, 4) is a rotation and a translation."""
    rotation = pose[:3, :3]
    turns = np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-3) and float(np.linalg.det(rotation)) > 0.0
    return bool(np.isfinite(pose).all() and turns and np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0)))


def _intrinsics(given: ArrayLike) -> Sequence[float]:
    """fx, fy, cx, cy [pixels]."""
    numbers = _numbers("intrinsics", given)
    if numbers.shape == (3, 3):
        numbers = np.array([numbers[0, 0], numbers[1, 1], numbers[0, 2], numbers[1, 2]])
    if numbers.shape != (4,) or not np.isfinite(numbers).all() or not (numbers[:2] > 0.0).all():
        raise SceneError("intrinsics", "must be [fx, fy, cx, cy] in pixels, or the camera matrix (3, 3).")
    values: list[float] = numbers.tolist()
    return values


def _numbers(name: str, given: Any) -> NDArray[np.float64]:
    try:
        return np.array(given, np.float64)
    except (TypeError, ValueError):
        raise SceneError(name, "must be numbers.") from None
