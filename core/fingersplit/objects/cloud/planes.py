"""Planes that things stand on or before, by which a scene is told from an object."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

__all__ = ["scene_share"]

MAX_PLANES, MIN_SHARE = 5, 0.1
"""Planes that are looked for, and the share of the points that each must have."""
MOST = 0.5
"""Share of the points from which a plane makes a scene of any size."""
MIN_EXTENT = 0.25
"""Least longest extent of a plane with less [m]: a lid with a knob is smaller, a table with things is not."""
MIN_WIDTH = 0.12
"""Least width of a floor whose edge is covered all around, as a bin's is by its walls [m]."""
ON_ONE_SIDE, BEFORE = 0.95, 0.8
"""Share of the others that must lie on one side of a plane, as what stands on a table does, and on the camera's side
where it is known: below are a table's legs, and nothing that stands on it."""
FOOTPRINT = 0.5
"""Most of the plane's area, or of its edge, that the others may cover; a tray's rim covers all of its floor."""
BESIDE_EDGE = 0.06
"""Distance of the edge, in longest extents, within which others cover it."""
WITHIN = 0.01
"""Least share of the points that stand farther from the edge than that; the sides of a plate are all beside it."""
NEAR_PLANE = 0.01
"""Distance from the plane, in longest extents, within which a point is part of it."""
MIN_OTHERS = 20
_TRIALS, _SHOWN = 200, 4_000


class _Plane(NamedTuple):
    """Unit normal (3,) on the side of what stands on a plane, its offset [m], and which points lie in it, (n,)."""

    normal: NDArray[np.float64]
    offset: float
    members: NDArray[np.bool_]


def scene_share(points: NDArray[np.float64], viewpoint: NDArray[np.float64] | None = None) -> float:
    """Share of the points (n, 3) in planes that the others stand on or before, as a table and walls; 0 without any.

    Planes are found by trials of three random points, always the same for the same points (RANSAC). Seen from a
    camera, others stand before a plane of a scene and lie behind the sides of an object.

    Args:
        points: (n, 3) [m].
        viewpoint: Where the camera stood, (3,) [m]; None where it is not known.
    """
    rng = np.random.default_rng(0)
    shown = points[rng.choice(len(points), min(len(points), _SHOWN), replace=False)]
    faced = (_faced(plane, shown, viewpoint) for plane in _planes(shown, rng))
    planes = [plane for plane in faced if plane is not None]
    in_planes = np.any([plane.members for plane in planes], axis=0) if planes else np.zeros(len(shown), bool)
    return float(in_planes.mean()) if any(_is_support(plane, ~in_planes, shown) for plane in planes) else 0.0


def _planes(points: NDArray[np.float64], rng: np.random.Generator) -> list[_Plane]:
    """The planes that most points lie in, one after the other from what is left."""
    near = NEAR_PLANE * float(np.ptp(points, axis=0).max())
    left, planes = np.arange(len(points)), list[_Plane]()
    while len(planes) < MAX_PLANES and len(left) >= max(3, MIN_SHARE * len(points)):
        a, b, c = points[left[rng.integers(len(left), size=(3, _TRIALS))]]
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.maximum(lengths, 1e-300)
        close = np.abs(points[left] @ normals.T - np.einsum("ij,ij->i", a, normals)) < near  # (left, trials)
        best = int(np.argmax(np.where(lengths[:, 0] > 0, close.sum(axis=0), -1)))  # a point drawn twice spans none
        inliers = points[left[close[:, best]]]
        middle = inliers.mean(axis=0)
        fitted = np.linalg.eigh((inliers - middle).T @ (inliers - middle))[1][:, 0]
        tried = ((fitted, float(middle @ fitted)), (normals[best], float(a[best] @ normals[best])))
        found = [_Plane(normal, offset, np.abs(points @ normal - offset) < near) for normal, offset in tried]
        plane = max(found, key=lambda each: int(each.members.sum()))
        if plane.members.mean() < MIN_SHARE:
            break
        planes.append(plane)
        kept = left[~plane.members[left]]
        if len(kept) == len(left):
            break
        left = kept
    return planes


def _faced(plane: _Plane, points: NDArray[np.float64], viewpoint: NDArray[np.float64] | None) -> _Plane | None:
    """The plane with its normal on the side of the others; None where they are on both, or behind it for the camera."""
    heights = points[~plane.members] @ plane.normal - plane.offset
    if len(heights) < MIN_OTHERS:
        return None
    if viewpoint is None:
        side, share = float(np.median(heights)), ON_ONE_SIDE
    else:
        side, share = float(viewpoint @ plane.normal) - plane.offset, BEFORE
    sign = -1.0 if side < 0 else 1.0
    if np.mean(sign * heights > 0) < share:
        return None
    return plane._replace(normal=sign * plane.normal, offset=sign * plane.offset)


def _is_support(plane: _Plane, things: NDArray[np.bool_], points: NDArray[np.float64]) -> bool:
    """Whether things, of those that lie in no plane, stand on one that goes on around them."""
    things = things & (points @ plane.normal > plane.offset)
    if np.count_nonzero(things) < max(MIN_OTHERS, WITHIN * len(points)):
        return False
    side = np.cross(plane.normal, np.eye(3)[np.argmin(np.abs(plane.normal))])
    side /= np.linalg.norm(side)
    flat = points @ np.column_stack([side, np.cross(plane.normal, side)])
    extent = float(np.ptp(flat[plane.members], axis=0).max())
    if plane.members.mean() < MOST and extent < MIN_EXTENT:
        return False
    try:
        table, covered = ConvexHull(flat[plane.members]), ConvexHull(flat[things])
    except QhullError:
        return False
    beside = BESIDE_EDGE * extent
    inside = (flat[things] @ table.equations[:, :2].T + table.equations[:, 2]).max(axis=1) < -beside
    if np.count_nonzero(inside) < WITHIN * len(points):
        return False
    if covered.volume < FOOTPRINT * table.volume:
        return True
    width = float(np.sqrt(12.0 * np.linalg.eigvalsh(np.cov(flat[plane.members], rowvar=False))[0]))
    is_floor = extent >= MIN_EXTENT and width >= MIN_WIDTH
    if is_floor and _area(flat[things][inside]) < FOOTPRINT * table.volume:
        return True  # what is beside the edge are a bin's walls
    return _edge_covered(flat[plane.members][table.vertices], flat[things], beside) < FOOTPRINT


def _area(flat: NDArray[np.float64]) -> float:
    """Area of the convex hull of places (n, 2) [m]; 0 where they span none."""
    try:
        return float(ConvexHull(flat).volume)
    except QhullError:
        return 0.0


def _edge_covered(outline: NDArray[np.float64], others: NDArray[np.float64], beside: float) -> float:
    """Share of an outline (n, 2) [m] that has others (m, 2) [m] beside it, as a tray's rim; several things leave it."""
    ends = np.roll(outline, -1, axis=0)
    lengths = np.linalg.norm(ends - outline, axis=1)
    places = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None, None]
    along = outline + places * (ends - outline)  # (20, n, 2)
    near = cKDTree(others).query(along)[0] < beside
    return float((near.mean(axis=0) * lengths).sum() / lengths.sum())
