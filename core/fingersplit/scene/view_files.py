"""Views as files: an archive of arrays, or a depth image and a mask."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import SceneError
from fingersplit.extras import extra
from fingersplit.scene.view import MAX_PIXELS, View

__all__ = ["read_view"]

_ARRAYS = ("depth", "points", "mask", "intrinsics", "depth_scale", "world_from_camera")


def read_view(
    path: Path,
    mask: Path | None = None,
    *,
    intrinsics: ArrayLike | None = None,
    depth_scale: float | None = None,
    world_from_camera: ArrayLike | None = None,
) -> View:
    """Read what a depth camera saw; what is given here counts more than what the file says.

    Args:
        path: ``.npz`` with ``depth`` (h, w) and ``intrinsics``, or an organised cloud ``points`` (h, w, 3), and perhaps
            ``mask`` (h, w), ``depth_scale`` and ``world_from_camera`` (4, 4); or a ``.png`` of 16 bits, in millimetres.
        mask: A ``.png`` whose pixels of the object are not 0.
        intrinsics: ``[fx, fy, cx, cy]`` or the camera matrix (3, 3), in pixels.
        depth_scale: Metres of one unit of depth.
        world_from_camera: Pose of the camera, (4, 4).

    Raises:
        SceneError: A file that cannot be read, or an entry that is missing or wrong.
    """
    if path.suffix.lower() == ".npz":
        given = _read_archive(path)
    elif path.suffix.lower() == ".png":
        given = {"depth": _read_png("file", path)}
    else:
        raise SceneError("file", f"{path.suffix or path.name!r} is no known format of views; known: .npz, .png.")
    said = {"intrinsics": intrinsics, "depth_scale": depth_scale, "world_from_camera": world_from_camera}
    given |= {name: value for name, value in said.items() if value is not None}
    if mask is not None:
        given["mask"] = _read_png("mask", mask)
    if "mask" not in given:
        raise SceneError("mask", "is missing: which pixels are the object to grasp?")
    pose = given.get("world_from_camera")
    if "points" in given:
        return View(given["points"], given["mask"], pose)
    if "depth" not in given:
        raise SceneError("depth", "is missing; an archive has depth and intrinsics, or points.")
    if "intrinsics" not in given:
        raise SceneError("intrinsics", "are missing: [fx, fy, cx, cy] in pixels, or the camera matrix (3, 3).")
    scale = given.get("depth_scale")
    if scale is not None and np.size(scale) != 1:
        raise SceneError("depth_scale", "must be one number, metres of one unit of depth.")
    return View.from_depth(
        given["depth"],
        given["mask"],
        given["intrinsics"],
        depth_scale=None if scale is None else float(np.ravel(scale)[0]),
        world_from_camera=pose,
    )


def _read_archive(path: Path) -> dict[str, Any]:
    """The arrays of an archive that belong to a view."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(one.file_size for one in archive.infolist() if one.filename.removesuffix(".npy") in _ARRAYS)
        if size > 64 * MAX_PIXELS:
            raise SceneError("file", f"holds {size / 1e6:.0f} MB of arrays; allowed: {64 * MAX_PIXELS / 1e6:.0f} MB.")
        with np.load(path, allow_pickle=False) as stored:
            given = {name: stored[name] for name in _ARRAYS if name in stored.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, NotImplementedError) as error:
        raise SceneError(
            "file", f"is no archive of plain arrays, or is damaged; give an .npz with {', '.join(_ARRAYS)}."
        ) from error
    for name, array in given.items():
        if array.dtype.kind not in "biuf":
            raise SceneError(name, f"holds {array.dtype}, not numbers.")
    return given


def _read_png(field: str, path: Path) -> NDArray[Any]:
    """The pixels of an image, (h, w) or (h, w, channels)."""
    with extra("pictures"):
        from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path, formats=("PNG",)) as image:
            if image.width * image.height > MAX_PIXELS:
                raise SceneError(field, f"has {image.width} x {image.height} pixels; allowed: {MAX_PIXELS:,}.")
            return np.array(image)
    except (OSError, UnidentifiedImageError, SyntaxError, ValueError) as error:
        raise SceneError(field, "is no PNG image, or is damaged.") from error
