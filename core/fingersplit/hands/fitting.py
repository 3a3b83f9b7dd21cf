"""The smallest primitive that contains a cloud of points, and how far it reaches beyond their convex hull."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.hands.shapes import corners_of
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CONVEX, CYLINDER, SPHERE
from fingersplit.transforms import pose_matrix, rotation_to_axis, transform_points

__all__ = ["Fit", "fit_primitive", "hull_points", "primitive_points", "primitive_volume"]

Array = NDArray[np.float64]

CIRCLE_STEPS = 40
CAPSULE_RADII = (1.0, 1.05, 1.1, 1.2, 1.3, 1.45)
ROUNDNESS = 0.97
"""A capsule or sphere is taken before a box up to this share of volume: links are round, and no corner sticks out."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A shape: kind and size as in ``hands.shapes_kernel`` [m], ``link_from_shape`` (4, 4), volume [m^3]."""

    kind: int
    size: Array
    pose: Array
    volume: float

    def overhang(self, points: Array) -> float:
        """How far its surface reaches beyond the convex hull of points (n, 3) at most, across the hull's faces [m]."""
        hull = _hull(points)
        if hull is None:
            return 0.0
        surface = transform_points(self.pose, primitive_points(self.kind, self.size))
        return max(0.0, float((surface @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1).max()))


def fit_primitive(points: Array) -> Fit:
    """The smallest of sphere, capsule, cylinder and box that contains points (n, 3) [m] of a link.

    Axes are those of the principal directions, of the hull's largest face and of the frame itself.
    """
    return _fit_primitive(points.tobytes())


@lru_cache(maxsize=4096)
def _fit_primitive(data: bytes) -> Fit:
    points = hull_points(np.frombuffer(data).reshape(-1, 3))
    fits = [_sphere(points)]
    for rotation in _frames(points):
        fits.append(_box(points @ rotation, rotation))
        for axis in np.eye(3):
            turned = rotation @ rotation_to_axis(axis)
            local = points @ turned
            circle = _enclosing(local[:, :2])
            fits += [_capsule(local, turned, *circle), _cylinder(local, turned, *circle)]
    weights = {SPHERE: ROUNDNESS, CAPSULE: ROUNDNESS}
    return min(fits, key=lambda fit: fit.volume * weights.get(fit.kind, 1.0))


def hull_points(points: Array) -> Array:
    """The points (n, 3) at the corners of their convex hull; all of them where they are flat."""
    hull = _hull(points)
    return points if hull is None else np.asarray(points[hull.vertices], np.float64)


def primitive_points(kind: int, size: Array) -> Array:
    """Points (n, 3) all over a primitive's surface in its own frame, its corners and ends among them [m]."""
    if kind == BOX:
        steps = np.linspace(-1, 1, 9)
        grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        return np.asarray(grid[np.abs(grid).max(axis=1) == 1] * size)
    if kind == CONVEX:
        return corners_of(size)
    turns = np.linspace(0, 2 * math.pi, 32, endpoint=False)
    if kind == CYLINDER:
        radii, heights = np.array([0, 0.5, 1, 1, 1, 1, 1, 0.5, 0]), np.array([-1, -1, -1, -0.5, 0, 0.5, 1, 1, 1])
        rings = np.column_stack([radii * size[0], heights * size[1]])
    else:
        lifts = np.linspace(-math.pi / 2, math.pi / 2, 18)
        half = size[1] if kind == CAPSULE else 0.0
        rings = np.column_stack([size[0] * np.cos(lifts), size[0] * np.sin(lifts) + half * np.sign(lifts)])
    across = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.concatenate([np.column_stack([r * across, np.full(len(turns), z)]) for r, z in rings])


def primitive_volume(kind: int, size: Array) -> float:
    """Volume of a primitive [m^3]."""
    if kind == SPHERE:
        return float(4 / 3 * math.pi * size[0] ** 3)
    if kind == CAPSULE:
        return float(math.pi * size[0] ** 2 * (4 / 3 * size[0] + 2 * size[1]))
    if kind == CYLINDER:
        return float(2 * math.pi * size[0] ** 2 * size[1])
    return float(8 * np.prod(size))


def _hull(points: Array) -> ConvexHull | None:
    try:
        return ConvexHull(points)
    except (QhullError, ValueError):
        return None


def _frames(points: Array) -> list[Array]:
    """Rotations (3, 3) worth trying as a primitive's axes."""
    frames = [np.eye(3)]
    spread = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    frames.append(_right_handed(spread.T))
    hull = _hull(points)
    if hull is not None:
        frames.append(_along(points, _main_normal(hull)))
    return frames


def _main_normal(hull: ConvexHull) -> Array:
    """Direction across which the faces of a hull are largest, opposite faces and nearly parallel ones as one (3,)."""
    normals = hull.equations[:, :3]
    largest = np.take_along_axis(normals, np.abs(normals).argmax(axis=1)[:, None], axis=1)
    rounded = np.round(normals * np.where(largest > 0, 1.0, -1.0), 2) + 0.0
    corners = hull.points[hull.simplices]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    kinds, which = np.unique(rounded, axis=0, return_inverse=True)
    return np.asarray(kinds[np.bincount(which.ravel(), areas).argmax()])


def _along(points: Array, normal: Array) -> Array:
    """A frame with z along ``normal`` whose box about the points has the smallest footprint."""
    frame = rotation_to_axis(normal)
    flat = _hull_2d(points @ frame[:, :2])
    edges = np.roll(flat, -1, axis=0) - flat
    best, smallest = frame, math.inf
    for angle in np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (math.pi / 2), 3)):
        c, s = math.cos(angle), math.sin(angle)
        turned = flat @ np.array([[c, -s], [s, c]])
        area = float(np.prod(np.ptp(turned, axis=0)))
        if area < smallest:
            best, smallest = frame @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), area
    return best


def _hull_2d(points: Array) -> Array:
    """Corners (n, 2) of the convex hull of points in the plane, counter-clockwise."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return points


def _right_handed(rotation: Array) -> Array:
    rotation = rotation.copy()
    rotation[:, 2] = np.cross(rotation[:, 0], rotation[:, 1])
    return rotation


def _enclosing(points: Array) -> tuple[Array, float]:
    """A ball about points (n, d), within a percent or so of the smallest [Badoiu2003]."""
    center = (points.max(axis=0) + points.min(axis=0)) / 2
    for step in range(CIRCLE_STEPS):
        farthest = points[np.argmax(((points - center) ** 2).sum(axis=1))]
        center = center + (farthest - center) / (step + 2)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    radii = [float(np.sqrt(((points - c) ** 2).sum(axis=1).max())) for c in (center, middle)]
    return (center, radii[0]) if radii[0] < radii[1] else (middle, radii[1])


def _fit(kind: int, size: Array, center: Array, rotation: Array) -> Fit:
    return Fit(kind, size, pose_matrix(rotation, rotation @ center), primitive_volume(kind, size))


def _sphere(points: Array) -> Fit:
    center, radius = _enclosing(points)
    return _fit(SPHERE, np.array([radius, 0.0, 0.0]), center, np.eye(3))


def _box(local: Array, rotation: Array) -> Fit:
    low, high = local.min(axis=0), local.max(axis=0)
    return _fit(BOX, np.maximum((high - low) / 2, 1e-4), (low + high) / 2, rotation)


def _cylinder(local: Array, rotation: Array, center: Array, radius: float) -> Fit:
    low, high = local[:, 2].min(), local[:, 2].max()
    size = np.array([max(radius, 1e-4), max((high - low) / 2, 1e-4), 0.0])
    return _fit(CYLINDER, size, np.array([*center, (low + high) / 2]), rotation)


def _capsule(local: Array, rotation: Array, center: Array, least: float) -> Fit:
    """Of several radii from the smallest possible one up, the one with which the capsule is smallest."""
    across = np.linalg.norm(local[:, :2] - center, axis=1)
    best: Fit | None = None
    for factor in CAPSULE_RADII:
        radius = max(least * factor, 1e-4)
        reach = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
        low, high = (local[:, 2] + reach).min(), (local[:, 2] - reach).max()
        if high < low:
            low = high = (low + high) / 2
        fit = _fit(CAPSULE, np.array([radius, (high - low) / 2, 0.0]), np.array([*center, (low + high) / 2]), rotation)
        if best is None or fit.volume < best.volume:
            best = fit
    assert best is not None
    return best
