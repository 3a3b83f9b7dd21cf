"""What a cloud's normals and points say before a surface is drawn through them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

__all__ = ["contradict", "point_inwards", "scene_plane"]

ONE_SIDED = 0.35
"""Least length of the mean normal of a cloud that was seen from one side; a closed surface has 0, a half ball 0.5."""
CONTRADICTION = 0.2
"""Share of neighbours on the same side of an object that face opposite ways, beyond which normals mean nothing."""
WALL = 0.2
"""Of a neighbour's distance: how far it lies before or behind a point whose wall it is on the other side of."""
FACING_AWAY = 0.7
"""Share of normals that face away from the viewpoint, beyond which all of them are the wrong way round."""

MIN_SHARE = 0.5
"""Share of the points that a plane must have to be most of a scene."""
ON_ONE_SIDE = 0.95
"""Share of the others that must lie on one side of it, as what stands on a table does."""
FOOTPRINT = 0.5
"""Most of the plane's area, or of its edge, that the others may cover; a tray's rim covers all of its floor."""
BESIDE_EDGE = 0.06
"""Distance of the edge, in longest extents, within which others cover it."""
NEAR_PLANE = 0.01
"""Distance from the plane, in longest extents, within which a point is part of it."""
_TRIALS, _SHOWN = 200, 4_000


def contradict(points: NDArray[np.float64], normals: NDArray[np.float64]) -> bool:
    """Whether unit normals (n, 3) at points (n, 3) [m] face opposite ways so often that they mean nothing.

    Opposite ones on the two sides of a thin wall, all of them behind each other or all before, are no contradiction.
    """
    distances, nearby = cKDTree(points).query(points, min(7, len(points)))
    nearby = nearby[:, 1:]
    cosines = np.einsum("ijk,ik->ij", normals[nearby], normals)
    parallel, opposite = np.abs(cosines) > 0.7, cosines < -0.7
    if not parallel.any():
        return False
    heights = np.einsum("ijk,ik->ij", points[nearby] - points[:, None], normals)
    wall = WALL * distances[:, 1:]
    opposed = min(np.count_nonzero(opposite & (heights > -wall)), np.count_nonzero(opposite & (heights < wall)))
    return bool(opposed > CONTRADICTION * np.count_nonzero(parallel))


def point_inwards(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    areas: NDArray[np.float64],
    viewpoint: NDArray[np.float64] | None,
) -> bool:
    """Whether normals point into the object: away from the camera, or, in a cloud from all sides, to its middle.

    Args:
        points: (n, 3) [m].
        normals: (n, 3), unit length.
        areas: Surface area that each point stands for, (n,), up to a factor.
        viewpoint: Where the camera stood, (3,) [m]; None where it is not known.
    """
    if viewpoint is not None:
        return bool(np.mean(np.einsum("ij,ij->i", normals, viewpoint - points) < 0) > FACING_AWAY)
    if np.linalg.norm(np.average(normals, axis=0, weights=areas)) > ONE_SIDED:
        return False
    return bool(areas @ np.einsum("ij,ij->i", points - points.mean(axis=0), normals) < 0)


def scene_plane(points: NDArray[np.float64]) -> float:
    """Share of the points (n, 3) in a plane that most of them lie in and that the others stand on; 0 without one.

    By trials of three random points, always the same for the same points (RANSAC).
    """
    rng = np.random.default_rng(0)
    shown = points[rng.choice(len(points), min(len(points), _SHOWN), replace=False)]
    near = NEAR_PLANE * float(np.ptp(shown, axis=0).max())
    best, normal, height = 0, np.zeros(3), 0.0
    for _ in range(_TRIALS):
        a, b, c = shown[rng.choice(len(shown), 3, replace=False)]
        direction = np.cross(b - a, c - a)
        length = np.linalg.norm(direction)
        if length > 0:
            heights = shown @ (direction / length) - a @ (direction / length)
            count = int(np.count_nonzero(np.abs(heights) < near))
            if count > best:
                best, normal, height = count, direction / length, float(a @ direction / length)
    heights = shown @ normal - height
    on_plane = np.abs(heights) < near
    share, others = float(on_plane.mean()), heights[~on_plane]
    if share < MIN_SHARE or len(others) < 20:
        return 0.0
    if max(np.mean(others > 0), np.mean(others < 0)) < ON_ONE_SIDE:
        return 0.0
    side = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    flat = shown @ np.column_stack([side, np.cross(normal, side)])
    try:
        table, things = ConvexHull(flat[on_plane]), ConvexHull(flat[~on_plane])
    except QhullError:
        return share
    if things.volume < FOOTPRINT * table.volume:
        return share
    return share if _edge_covered(flat[on_plane][table.vertices], flat[~on_plane]) < FOOTPRINT else 0.0


def _edge_covered(outline: NDArray[np.float64], others: NDArray[np.float64]) -> float:
    """Share of an outline (n, 2) [m] that has others (m, 2) [m] beside it, as a tray's rim; several things leave it."""
    ends = np.roll(outline, -1, axis=0)
    lengths = np.linalg.norm(ends - outline, axis=1)
    places = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None, None]
    along = outline + places * (ends - outline)  # (20, n, 2)
    beside = cKDTree(others).query(along)[0] < BESIDE_EDGE * float(np.ptp(outline, axis=0).max())
    return float((beside.mean(axis=0) * lengths).sum() / lengths.sum())
