"""From a file's bytes to a `PointCloud`."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.errors import ObjectFileError
from fingersplit.objects.cloud import MIN_POINTS, PointCloud, check_cloud
from fingersplit.objects.cloud.checks import belong, contradict, point_inwards
from fingersplit.objects.cloud.normals import find_outliers
from fingersplit.objects.cloud.planes import scene_share
from fingersplit.objects.intake.cloud_parsing import RawCloud, parse_cloud
from fingersplit.objects.intake.report import CloudReport
from fingersplit.objects.source import ObjectSource

__all__ = ["read_cloud"]


def read_cloud(data: bytes, file_type: str, source: ObjectSource | None = None) -> tuple[PointCloud, CloudReport]:
    """Turn the file of a point cloud into points in metres, without what is no point of the object.

    Points that are not finite, that repeat another or that stand far from all others are dropped.

    Args:
        data: The file's bytes.
        file_type: Key of `CLOUD_FORMATS`.
        source: Unit and scale of the file's numbers, where the camera and the object stood; None for metres.

    Raises:
        ObjectFileError: The file holds no cloud of an object; ``code`` names the fault.
    """
    source = source or ObjectSource()
    raw = parse_cloud(data, file_type)
    if source.viewpoint is not None:
        raw = raw._replace(viewpoint=np.array(source.viewpoint))
    if source.support is not None:
        raw = raw._replace(support=np.array(source.support))
    if raw.viewpoint is not None and not np.isfinite(raw.viewpoint).all():
        raise ObjectFileError("non_finite", f"The viewpoint {raw.viewpoint.tolist()} must be three numbers.")
    kept, n_finite, n_different = _kept(raw)
    points = raw.points[kept] * source.meters
    if len(points):
        source.check_extent(float(np.ptp(points, axis=0).max()))
    check_cloud(points)
    viewpoint = None if raw.viewpoint is None else raw.viewpoint * source.meters
    normals = None if raw.normals is None else _usable(points, raw.normals[kept])
    turned = normals is not None and point_inwards(points, normals, np.ones(len(points)), viewpoint)
    support = None if raw.support is None else _plane(raw.support, points, source.meters)
    cloud = PointCloud(points, -normals if normals is not None and turned else normals, viewpoint, support)
    return cloud, CloudReport(
        file_type=file_type,
        unit=source.unit,
        scale=source.scale,
        points_in_file=len(raw.points),
        points=len(points),
        non_finite_points=len(raw.points) - n_finite,
        repeated_points=n_finite - n_different,
        outliers=n_different - len(kept),
        normals=normals is not None,
        viewpoint=cloud.viewpoint is not None,
        spacing=float(np.median(cKDTree(points).query(points, 2)[0][:, 1])),
        normals_turned=turned,
        plane_share=scene_share(points, viewpoint),
        support=support is not None,
    )


def _plane(given: NDArray[np.float64], points: NDArray[np.float64], meters: float) -> NDArray[np.float64]:
    """The support (4,) in metres with a unit normal, if it is a plane and points (n, 3) [m] stand on it."""
    length = float(np.linalg.norm(given[:3])) if np.isfinite(given).all() else 0.0
    if not length > 0.0:
        raise ObjectFileError("non_finite", f"The support {given.tolist()} must be a normal, not 0, and an offset.")
    plane = np.append(given[:3] / length, given[3] / length * meters)
    if np.median(points @ plane[:3]) < plane[3]:
        raise ObjectFileError(
            "below_support", "The points lie below the support: its normal must point to the side of the object."
        )
    return plane


def _kept(raw: RawCloud) -> tuple[NDArray[np.integer], int, int]:
    """Indices of the points that belong to the object, and how many were finite and different."""
    kept = np.flatnonzero(np.isfinite(raw.points).all(axis=1) & (np.abs(raw.points) < 1e9).all(axis=1))
    n_finite = len(kept)
    kept = kept[np.unique(raw.points[kept], axis=0, return_index=True)[1]]
    kept.sort()
    n_different = len(kept)
    if n_different >= MIN_POINTS:
        kept = kept[~find_outliers(raw.points[kept])]
    return kept, n_finite, n_different


def _usable(points: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The normals, if all of them are directions, do not contradict each other and are those of the points."""
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(normals, axis=1)
    good = np.isfinite(lengths) & (lengths > 1e-6)
    if not good.all():
        return None
    normals = normals / lengths[:, None]
    return None if contradict(points, normals) or not belong(points, normals) else normals
