"""Thinning, outliers and normals of a point cloud."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from fingersplit.objects.cloud.checks import contradict, point_inwards
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
    noise. They point as the cloud's own do, unless those contradict each other or point inwards, or else towards its
    viewpoint; where neither is known, they agree with their neighbours along the tree of least turns [Hoppe1992], and
    the whole points away from its middle, unless neighbours agree better when all point to one side, as they do in a
    cloud from one view.
    """
    points, own = _thinned(cloud)
    keep = ~find_outliers(points)
    points, own = points[keep], None if own is None else own[keep]
    count = min(MIN_NEIGHBOURS, len(points) - 1)
    tree = cKDTree(points)
    distances, neighbours = tree.query(points, count + 1)
    _, noise, _ = _fit_planes(points, neighbours)
    wider = np.median(distances[:, -1]) < NOISE_REACH * noise
    if wider:
        count = int(
            min(count * (NOISE_REACH * noise / np.median(distances[:, -1])) ** 2, MAX_NEIGHBOURS, len(points) - 1)
        )
        distances, neighbours = tree.query(points, count + 1)
    normals, noise, areas = _fit_planes(points, neighbours)
    if own is not None:
        lengths = np.linalg.norm(own, axis=1, keepdims=True)  # 0 where the normals of a voxel cancel
        own = own / np.where(lengths > 0, lengths, 1.0)
        own = None if np.median(lengths) == 0 or contradict(points, own) else own
    if own is not None:
        turned = np.einsum("ij,ij->i", normals, own) < 0
    elif cloud.viewpoint is not None:
        turned = np.einsum("ij,ij->i", normals, cloud.viewpoint - points) < 0
    else:
        turned = _against_neighbours(points, normals, neighbours[:, : MIN_NEIGHBOURS // 2])
    normals = np.where(turned[:, None], -normals, normals)
    if own is not None and point_inwards(points, normals, areas, cloud.viewpoint):
        normals = -normals
    return OrientedPoints(points, normals, areas, float(np.sqrt(np.median(areas))), noise)


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


def _fit_planes(
    points: NDArray[np.float64], neighbours: NDArray[np.integer]
) -> tuple[NDArray[np.float64], float, NDArray[np.float64]]:
    """Normal of every neighbourhood, typical deviation from its plane [m], and the area for one point in it [m^2]."""
    offsets = points[neighbours]
    offsets = offsets - offsets.mean(axis=1, keepdims=True)
    spreads, axes = np.linalg.eigh(offsets.transpose(0, 2, 1) @ offsets / neighbours.shape[1])
    noise = float(np.sqrt(np.median(np.maximum(spreads[:, 0], 0.0))))
    # An even disk of radius r has the variance r^2 / 4 along each axis.
    areas = 4 * np.pi * np.sqrt(np.maximum(spreads[:, 1] * spreads[:, 2], 0.0)) / neighbours.shape[1]
    return axes[:, :, 0], noise, areas


def _against_neighbours(
    points: NDArray[np.float64], normals: NDArray[np.float64], neighbours: NDArray[np.integer]
) -> NDArray[np.bool_]:
    """Normals to turn, (n,), so that neighbours agree and the whole points outwards."""
    rows, columns = np.repeat(np.arange(len(points)), neighbours.shape[1] - 1), neighbours[:, 1:].ravel()
    cosines = np.einsum("ij,ij->i", normals[rows], normals[columns])

    def disagreement(signs: NDArray[np.float64]) -> float:
        return float(np.maximum(-signs[rows] * signs[columns] * cosines, 0).sum())

    signs = _spread_signs(points, normals, rows, columns, cosines)
    one_sided = signs
    for _ in range(3):
        one_sided = np.where(normals @ (one_sided @ normals) < 0, -1.0, 1.0)
    return np.asarray((signs if disagreement(signs) <= disagreement(one_sided) else one_sided) < 0)


def _spread_signs(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    rows: NDArray[np.integer],
    columns: NDArray[np.integer],
    cosines: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Signs (n,) that agree along the spanning tree of least turns, every part of it away from the middle."""
    n = len(points)
    links = coo_array((1 - np.abs(cosines) + 1e-6, (rows, columns)), shape=(n, n)).tocsr()
    tree = minimum_spanning_tree(links)
    n_parts, part = connected_components(tree, directed=False)
    signs = np.ones(n)
    away = np.einsum("ij,ij->i", points - points.mean(axis=0), normals)
    for number in range(n_parts):
        members = np.flatnonzero(part == number)
        order, before = breadth_first_order(tree, members[0], directed=False)
        agree = np.where(np.einsum("ij,ij->i", normals[order[1:]], normals[before[order[1:]]]) < 0, -1.0, 1.0)
        for i, sign in zip(order[1:], agree, strict=True):
            signs[i] = sign * signs[before[i]]
        if signs[members] @ away[members] < 0:
            signs[members] *= -1
    return signs
