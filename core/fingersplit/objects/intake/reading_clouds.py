"""From a file's bytes to a `PointCloud`, and from any file to a mesh or a cloud."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.errors import MeshError
from fingersplit.objects.cloud import MIN_POINTS, PointCloud, check_cloud
from fingersplit.objects.cloud.normals import find_outliers
from fingersplit.objects.intake.cloud_parsing import CLOUD_FORMATS, RawCloud, holds_cloud, parse_cloud
from fingersplit.objects.intake.parsing import CHECKS
from fingersplit.objects.intake.reading import read_file, read_mesh
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.intake.units import check_extent, meters_per
from fingersplit.objects.mesh import Mesh

__all__ = ["FORMATS", "load_object", "read_cloud", "read_object"]

FORMATS = tuple(dict.fromkeys([*CHECKS, *CLOUD_FORMATS]))
"""Suffixes of all files that can be read."""


def load_object(
    path: Path, unit: str = "m", viewpoint: tuple[float, float, float] | None = None
) -> tuple[Mesh, IntakeReport] | tuple[PointCloud, CloudReport]:
    """Read the file of a mesh or a point cloud, whose suffix tells the format; see `read_object`."""
    return read_object(read_file(path), path.suffix, unit, viewpoint)


def read_object(
    data: bytes, file_type: str, unit: str = "m", viewpoint: tuple[float, float, float] | None = None
) -> tuple[Mesh, IntakeReport] | tuple[PointCloud, CloudReport]:
    """Turn a file into a clean surface or a point cloud.

    Args:
        data: The file's bytes.
        file_type: Format, with or without a leading dot: one of `FORMATS`. A PLY file without faces is a cloud.
        unit: Length unit of the file's numbers, a key of `UNITS`.
        viewpoint: Where the camera stood that saw the cloud, in the file's frame and unit; None for what the file says.

    Returns:
        The mesh or the cloud in metres, and what was found and done.

    Raises:
        MeshError: The file, or what it holds, is no graspable object, or a viewpoint is given for a mesh.
    """
    name = file_type.lower().removeprefix(".")
    if name not in FORMATS:
        raise MeshError("unknown_format", f"Unknown format {file_type!r}; known formats: {', '.join(FORMATS)}.")
    if holds_cloud(data, name):
        return read_cloud(data, name, unit, viewpoint)
    if viewpoint is not None:
        raise MeshError("needless_viewpoint", "A viewpoint belongs to a point cloud, but the file holds a mesh.")
    return read_mesh(data, name, unit)


def read_cloud(
    data: bytes, file_type: str, unit: str = "m", viewpoint: tuple[float, float, float] | None = None
) -> tuple[PointCloud, CloudReport]:
    """Turn the file of a point cloud into points in metres, without what is no point of the object.

    Points that are not finite, that repeat another or that stand far from all others are dropped. Arguments and
    errors are those of `read_object`.
    """
    scale = meters_per(unit)
    raw = parse_cloud(data, file_type)
    if viewpoint is not None:
        raw = raw._replace(viewpoint=np.array(viewpoint, dtype=np.float64))
    if raw.viewpoint is not None and not np.isfinite(raw.viewpoint).all():
        raise MeshError("non_finite", f"The viewpoint {raw.viewpoint.tolist()} must be three numbers.")
    kept, counts = _kept(raw)
    points = raw.points[kept] * scale
    if len(points):
        check_extent(float(np.ptp(points, axis=0).max()), unit)
    check_cloud(points)
    normals = None if raw.normals is None else _usable(raw.normals[kept])
    cloud = PointCloud(points, normals, None if raw.viewpoint is None else raw.viewpoint * scale)
    return cloud, CloudReport(
        file_type=file_type,
        unit=unit,
        points_in_file=len(raw.points),
        points=len(points),
        **counts,
        normals=normals is not None,
        viewpoint=cloud.viewpoint is not None,
        spacing=float(np.median(cKDTree(points).query(points, 2)[0][:, 1])),
    )


def _kept(raw: RawCloud) -> tuple[NDArray[np.integer], dict[str, int]]:
    """Indices of the points that belong to the object, and how many were dropped for which reason."""
    kept = np.flatnonzero(np.isfinite(raw.points).all(axis=1) & (np.abs(raw.points) < 1e9).all(axis=1))
    n_finite = len(kept)
    kept = kept[np.unique(raw.points[kept], axis=0, return_index=True)[1]]
    kept.sort()
    n_different = len(kept)
    if n_different >= MIN_POINTS:
        kept = kept[~find_outliers(raw.points[kept])]
    return kept, {
        "non_finite_points": len(raw.points) - n_finite,
        "repeated_points": n_finite - n_different,
        "outliers": n_different - len(kept),
    }


def _usable(normals: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The normals, if all of them are directions."""
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(normals, axis=1)
    good = np.isfinite(lengths) & (lengths > 1e-6)
    return normals / lengths[:, None] if good.all() else None
