"""Points out of a file: pypcd4 and numpy parse what the header checks let through."""

import io
import zipfile
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.extras import extra
from fingersplit.objects.intake.content import checked_content, or_other_format
from fingersplit.objects.intake.pcd import check_pcd
from fingersplit.objects.intake.ply import has_faces, ply_vertices
from fingersplit.objects.intake.refusals import MAX_FACES, check_count, malformed, truncated

__all__ = ["CLOUD_FORMATS", "RawCloud", "holds_cloud", "parse_cloud"]

_NORMALS = ("nx", "ny", "nz")
_MAX_BYTES = 64 * MAX_FACES  # of one array in an .npz file: points as double precision, and some room


class RawCloud(NamedTuple):
    """What a file says, in its own unit.

    Attributes:
        points: (n, 3), not all of them finite.
        normals: (n, 3), or None.
        viewpoint: (3,), or None.
        support: (4,), or None.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64] | None
    viewpoint: NDArray[np.float64] | None
    support: NDArray[np.float64] | None = None


def holds_cloud(data: bytes, file_type: str) -> bool:
    """Whether a file is to be read as a point cloud: by its format, and for PLY by whether it has faces."""
    return file_type in CLOUD_FORMATS and not (file_type == "ply" and has_faces(data))


def parse_cloud(data: bytes, file_type: str) -> RawCloud:
    """Parse the file of a point cloud.

    Args:
        data: The file's bytes.
        file_type: One of `CLOUD_FORMATS`.

    Raises:
        ObjectFileError: The file is empty, broken or cut off, or holds no or too many points.
    """
    try:
        with np.errstate(all="ignore"):  # numbers that are not finite are counted later
            cloud = CLOUD_FORMATS[file_type](checked_content(data, file_type))
    except ObjectFileError as refusal:
        raise or_other_format(refusal, data, file_type) from refusal.__cause__
    except MemoryError as error:
        raise ObjectFileError("too_many_points", "The cloud does not fit in memory; thin it out first.") from error
    except zipfile.BadZipFile:
        raise or_other_format(malformed("The NPZ file is no whole zip archive."), data, file_type) from None
    except Exception as error:
        # As with meshes: the parsers raise anything on broken files, and the file is at fault.
        raise malformed(f"The file does not follow the {file_type.upper()} format.") from error
    if not len(cloud.points):
        raise ObjectFileError("no_points", "The file has no point; a cloud is needed.")
    return cloud


def _parse_pcd(data: bytes) -> RawCloud:
    with extra("clouds"):
        from pypcd4.pypcd4 import PointCloud as PcdFile
    checked = check_pcd(data)
    try:
        cloud = PcdFile.from_fileobj(io.BufferedReader(io.BytesIO(checked)))
    except Exception as error:  # lengths and words agree with the header, so it is in the numbers or their packing
        packed = b"\nDATA binary_compressed\n" in checked
        raise malformed(
            "The packed points of the PCD file are damaged: they do not unpack."
            if packed
            else "A point of the PCD file has a number that does not fit the TYPE and SIZE of its field."
        ) from error
    rows = np.atleast_1d(cloud.pc_data)
    viewpoint = np.array(cloud.metadata.viewpoint[:3])
    # All zero is what programs write that do not know it.
    return RawCloud(
        _columns(rows, "x", "y", "z"),
        _columns(rows, "normal_x", "normal_y", "normal_z") if "normal_z" in (rows.dtype.names or ()) else None,
        viewpoint if viewpoint.any() else None,
    )


def _parse_ply(data: bytes) -> RawCloud:
    columns = ply_vertices(data)
    normals = np.column_stack([columns[name] for name in _NORMALS]) if set(_NORMALS) <= set(columns) else None
    return RawCloud(np.column_stack([columns[name] for name in "xyz"]), normals, None)


def _parse_npz(data: bytes) -> RawCloud:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        arrays = {
            entry.filename.removesuffix(".npy"): _read_array(archive, entry)
            for entry in archive.infolist()
            if entry.filename in ("points.npy", "normals.npy", "viewpoint.npy", "support.npy")
        }
    points, normals, viewpoint, support = (arrays.get(name) for name in ("points", "normals", "viewpoint", "support"))
    if points is None or points.shape[-1:] != (3,):
        raise malformed("The NPZ file must hold an array 'points' whose last axis has x, y and z.")
    if normals is not None and normals.shape != points.shape:
        raise malformed(f"The NPZ array 'normals' has the shape {normals.shape}; that of the points is {points.shape}.")
    if viewpoint is not None and viewpoint.shape != (3,):
        raise malformed(f"The NPZ array 'viewpoint' has the shape {viewpoint.shape}; it must be (3,).")
    if support is not None and support.shape != (4,):
        raise malformed(
            f"The NPZ array 'support' has the shape {support.shape}; it must be (4,): the normal of the plane that the "
            "object stands on, and its offset."
        )
    return RawCloud(points.reshape(-1, 3), None if normals is None else normals.reshape(-1, 3), viewpoint, support)


def _read_array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> NDArray[np.float64]:
    """One array of an .npz file, if it is as long as both of its headers say."""
    check_count(entry.file_size // 64, _MAX_BYTES // 64, "numbers")
    name = entry.filename.removesuffix(".npy")
    try:
        with archive.open(entry) as file:
            content = file.read(_MAX_BYTES + 1)
    except Exception as error:  # zipfile passes on whatever its packages raise on damaged bytes
        raise malformed(f"The NPZ array {name!r} is damaged: its bytes in the zip archive do not unpack.") from error
    stream = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(stream)
        reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = reader(stream)
    except ValueError as error:
        raise malformed(f"The NPZ array {name!r} has no header that says its type and shape.") from error
    if dtype.kind not in "fiu":
        raise malformed(f"The NPZ array {name!r} holds {dtype.name}, not numbers.")
    n_bytes = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if n_bytes != len(content) - stream.tell():
        raise truncated(f"an array of {n_bytes:,} bytes", f"{len(content) - stream.tell():,}")
    check_count(int(np.prod(shape, dtype=object)) // 3, MAX_FACES, "points")
    return np.asarray(np.load(io.BytesIO(content), allow_pickle=False), dtype=np.float64)


def _columns(rows: NDArray[Any], *names: str) -> NDArray[np.float64]:
    return np.stack([rows[name].astype(np.float64) for name in names], axis=1)


CLOUD_FORMATS: dict[str, Callable[[bytes], RawCloud]] = {"pcd": _parse_pcd, "ply": _parse_ply, "npz": _parse_npz}
"""Parser of each format of point clouds, by its suffix."""
