"""What a cloud's normals and points say before a surface is drawn through them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.objects.cloud.visibility import look_from_all_sides

__all__ = ["ONE_SIDED", "belong", "contradict", "point_inwards"]

ONE_SIDED = 0.35
"""Least length of the mean normal of a cloud that was seen from one side; a closed surface has 0, a half ball 0.5."""
CONTRADICTION = 0.2
"""Share of neighbours on the same side of an object that face opposite ways, beyond which normals mean nothing."""
WALL = 0.2
"""Of a neighbour's distance: how far it lies before or behind a point whose wall it is on the other side of."""
FLAT, MIN_FLAT, NEIGHBOURS = 0.05, 20, 13
"""Share of its greater variance that a neighbourhood has across it where it is flat, how many of these tell something,
and how many points each has."""
ALONG = 0.15
"""Share of flat neighbourhoods whose normals lie along them rather than across, beyond which they are of something
else."""
MAX_OPENNESS, FROM_BEHIND = 0.11, 0.35
"""Of a closed body (`Visibility`), and the share of its points that are seen from behind their normals, beyond which
these are mixed; near one all of them are the wrong way round."""
MAX_SHOWN = 4_000
"""Points that are looked at, drawn at random from more."""
FACING_AWAY = 0.7
"""Share of normals that face away from the viewpoint, beyond which all of them are the wrong way round."""


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


def belong(points: NDArray[np.float64], normals: NDArray[np.float64]) -> bool:
    """Whether unit normals (n, 3) can be those of the surface through points (n, 3) [m].

    They are not where many lie along the points rather than across them, or where the points close off a body and
    about as many normals point into it as out of it.
    """
    shown = np.random.default_rng(0).choice(len(points), min(len(points), MAX_SHOWN), replace=False)
    points, normals = points[shown], normals[shown]
    distances, nearby = cKDTree(points).query(points, min(NEIGHBOURS, len(points)))
    offsets = points[nearby] - points[nearby].mean(axis=1, keepdims=True)
    spreads, axes = np.linalg.eigh(offsets.transpose(0, 2, 1) @ offsets)
    flat = spreads[:, 0] < FLAT * spreads[:, 1]
    across = np.abs(np.einsum("ij,ij->i", axes[flat, :, 0], normals[flat]))
    if len(across) >= MIN_FLAT and np.mean(across < 0.5) > ALONG:
        return False
    # The disk that holds k + 1 points has the area of as many.
    spacing = float(np.median(distances[:, -1])) * np.sqrt(np.pi / nearby.shape[1])
    seen = look_from_all_sides(points, normals, np.ones(len(points)), spacing, 0.0)
    behind = float(np.mean(seen.front < seen.back))
    return seen.openness > MAX_OPENNESS or not FROM_BEHIND < behind < 1 - FROM_BEHIND


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
    if np.linalg.norm(np.average(normals, axis=0, weights=areas)) > ONE_SIDED:
        if viewpoint is None:
            return False
        return bool(np.mean(np.einsum("ij,ij->i", normals, viewpoint - points) < 0) > FACING_AWAY)
    # They are from all sides, whatever was said of a camera.
    return bool(areas @ np.einsum("ij,ij->i", points - points.mean(axis=0), normals) < 0)
