"""Thinning, outliers and normals of a point cloud."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.objects.cloud.checks import contradict, point_inwards
from fingersplit.objects.cloud.layers import Planes, fit_layers, fit_planes
from fingersplit.objects.cloud.orientation import orient_closed, orient_open
from fingersplit.objects.cloud.point_cloud import PointCloud

__all__ = ["OrientedPoints", "find_outliers", "orient_points"]

OUTLIER_NEIGHBOURS = 12
OUTLIER_DEVIATIONS = 4.0
"""A point is an outlier when the mean distance to its neighbours is so many deviations above the typical one."""
FINEST_VOXELS = 160
"""Along the longest extent; points closer together than that are averaged, which takes noise away too."""
MIN_NEIGHBOURS, MAX_NEIGHBOURS = 20, 120
NOISE_REACH = 6.0
"""Radius of the neighbourhood that a normal is fitted to, in standard deviations of the noise."""
OPPOSITE = -0.3
"""Cosine of two normals below which their points lie on the two sides of a wall."""
JUDGING = 10
"""Neighbours that judge which way is out."""
ROUNDS = 3
"""How often the outside is judged anew, with planes through points of the same side."""


class OrientedPoints(NamedTuple):
    """Thinned points with outward normals.

    Attributes:
        points: (n, 3) [m].
        normals: Outward unit normals, (n, 3).
        areas: Surface area that each stands for, (n,) [m^2].
        spacing: Typical distance of neighbouring points [m].
        noise: Standard deviation of the points across the surface [m].
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    areas: NDArray[np.float64]
    spacing: float
    noise: float


def find_outliers(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Points much farther from their neighbours than most, (n,): statistical outlier removal with robust statistics."""
    count = min(OUTLIER_NEIGHBOURS, len(points) - 1)
    distances = cKDTree(points).query(points, count + 1)[0][:, 1:].mean(axis=1)
    typical = np.median(distances)
    deviation = 1.4826 * np.median(np.abs(distances - typical))  # of a normal distribution
    return np.asarray(distances > typical + OUTLIER_DEVIATIONS * max(deviation, 0.25 * typical))


def orient_points(cloud: PointCloud) -> OrientedPoints:
    """Thin a cloud, leave out its outliers, and find the outward normal and the area of every point left.

    Normals are those of the planes that fit the neighbours best, which are taken from farther away where there is more
    noise, and from one side of thin walls only. They point as the cloud's own do, unless those contradict each other or
    point inwards, or else towards its viewpoint. Where neither is known, they point to the side that a point is seen
    from if the points close off a body, and otherwise to the side that neighbours agree on best.
    """
    points, own = _thinned(cloud)
    keep = ~find_outliers(points)
    points, own = points[keep], None if own is None else own[keep]
    own = None if own is None else _usable(points, own)
    tree = cKDTree(points)
    neighbours, planes = _neighbourhoods(points, own, tree, one_sided=cloud.viewpoint is not None)
    if own is not None:
        towards = own
    elif cloud.viewpoint is not None:
        towards = cloud.viewpoint - points
    else:
        planes, towards = _judged_from_shape(points, tree, neighbours, planes)
    normals = np.where(np.einsum("ij,ij->i", planes.normals, towards)[:, None] < 0, -planes.normals, planes.normals)
    if own is not None and point_inwards(points, normals, planes.areas, cloud.viewpoint):
        normals = -normals
    return OrientedPoints(points, normals, planes.areas, float(np.sqrt(np.median(planes.areas))), planes.noise)


def _judged_from_shape(
    points: NDArray[np.float64], tree: cKDTree, neighbours: NDArray[np.integer], planes: Planes
) -> tuple[Planes, NDArray[np.float64]]:
    """Planes through points of which only the places are known, and directions out of the object (n, 3)."""
    towards = planes.normals
    for _ in range(ROUNDS):
        outwards = orient_closed(points, planes, neighbours[:, :JUDGING])
        if outwards is None:
            neighbours, planes = _neighbourhoods(points, None, tree, one_sided=True)
            return planes, orient_open(points, planes.normals, neighbours[:, :JUDGING])
        towards, same = outwards, _on_same_side(outwards, neighbours)
        planes = fit_planes(points, neighbours, same)
        if same is None:
            break
    return planes, towards


def _neighbourhoods(
    points: NDArray[np.float64], own: NDArray[np.float64] | None, tree: cKDTree, one_sided: bool
) -> tuple[NDArray[np.integer], Planes]:
    """Neighbours (n, k) of every point and the planes through them, as many as the noise asks for.

    Args:
        points: (n, 3) [m].
        own: Usable unit normals of the cloud, (n, 3); None without.
        tree: Of the points.
        one_sided: Whether the points show one side of a wall only, as those that one camera saw.
    """

    def fit(count: int) -> tuple[NDArray[np.floating], NDArray[np.integer], Planes]:
        distances, neighbours = tree.query(points, count + 1)
        if own is not None:
            planes = fit_planes(points, neighbours, _on_same_side(own, neighbours))
        else:
            planes = fit_planes(points, neighbours) if one_sided else fit_layers(points, neighbours)
        return distances, neighbours, planes

    count = min(MIN_NEIGHBOURS, len(points) - 1)
    distances, neighbours, planes = fit(count)
    typical = float(np.median(distances[:, -1]))
    if typical < NOISE_REACH * planes.noise:
        count = int(min(count * (NOISE_REACH * planes.noise / typical) ** 2, MAX_NEIGHBOURS, len(points) - 1))
        _, neighbours, planes = fit(count)
    return neighbours, planes


def _on_same_side(normals: NDArray[np.float64], neighbours: NDArray[np.integer]) -> NDArray[np.bool_] | None:
    """Neighbours (n, k) that do not face the opposite way, as on the other side of a wall; None for nearly all."""
    same = np.einsum("ijk,ik->ij", normals[neighbours], normals) > OPPOSITE
    return None if np.mean(same) > 0.995 else same


def _usable(points: NDArray[np.float64], own: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Mean normals (n, 3) of voxels as unit ones; None where they cancel or contradict each other."""
    lengths = np.linalg.norm(own, axis=1, keepdims=True)  # 0 where the normals of a voxel cancel
    own = own / np.where(lengths > 0, lengths, 1.0)
    return None if np.median(lengths) == 0 or contradict(points, own) else own


def _thinned(cloud: PointCloud) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Mean point, and mean normal, of every voxel that has any."""
    voxel = cloud.extents.max() / FINEST_VOXELS
    cells = ((cloud.points - cloud.points.min(axis=0)) / voxel).astype(np.int64)
    keys = (cells[:, 0] * (FINEST_VOXELS + 2) + cells[:, 1]) * (FINEST_VOXELS + 2) + cells[:, 2]
    _, group, counts = np.unique(keys, return_inverse=True, return_counts=True)
    points, own = (
        None if part is None else np.stack([np.bincount(group, axis) for axis in part.T], axis=1) / counts[:, None]
        for part in (cloud.points, cloud.normals)
    )
    assert points is not None
    return points, own
