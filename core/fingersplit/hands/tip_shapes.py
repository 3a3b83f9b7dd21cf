"""Collision shapes of fingertips: their own convex hulls, with as many planes as the kernels have room for.

A pad touches the object. The smallest box about a rounded tip stands out millimetres beyond the pad's sphere, so every
contact would count as a collision.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, HalfspaceIntersection

from fingersplit.hands.fingers import Pad
from fingersplit.hands.fitting import Fit
from fingersplit.hands.limits import MAX_PLANES, PAD_ANGLE_LIMIT
from fingersplit.hands.shapes_kernel import CONVEX
from fingersplit.transforms import pose_matrix, rotation_to_axis

__all__ = ["cone", "convex_fit", "stand_out"]

Array = NDArray[np.float64]

DIRECTIONS = 300
"""Directions in the cone of a pad, in which shapes are compared with it."""
PRECISE = 5e-5
"""[m]; planes are added until the solid reaches no farther beyond the hull."""
BESIDE_PAD = 4.0
"""Reaching beyond the hull counts so many times where a pad touches."""


def stand_out(points: Array, pads: tuple[Pad, ...]) -> float:
    """How far points (n, 3) of a pad's link stand out beyond a plane that touches a pad as a contact may [m].

    Negative where none does; the largest over the pads.
    """
    found = []
    for pad in pads:
        directions = cone(pad.normal, _max_angle(pad))
        found.append(((points @ directions.T).max(axis=0) - (directions @ pad.center + pad.radius)).max())
    return float(max(found))


def convex_fit(points: Array, pads: tuple[Pad, ...]) -> Fit:
    """A convex solid about points (n, 3) [m] in the frame of the pads' link, most exact where pads touch.

    Of the planes of their hull, one after the other is taken that cuts most off.
    """
    key = tuple((pad.center.tobytes(), pad.normal.tobytes(), pad.radius, pad.max_angle) for pad in pads)
    return _convex_fit(np.ascontiguousarray(points).tobytes(), key)


@lru_cache(maxsize=256)
def _convex_fit(data: bytes, key: tuple[tuple[bytes, bytes, float, float | None], ...]) -> Fit:
    points = np.frombuffer(data).reshape(-1, 3)
    pads = [Pad(0, np.frombuffer(c), np.frombuffer(n), radius, angle) for c, n, radius, angle in key]
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    hull = ConvexHull(points - center)
    inner = hull.points[hull.vertices].mean(axis=0)
    equations = np.unique(np.round(hull.equations, 7), axis=0)
    axes = np.vstack([np.eye(3), -np.eye(3)])
    planes = np.column_stack([axes, -(hull.points @ axes.T).max(axis=0)])
    while True:
        corners = HalfspaceIntersection(planes, inner).intersections
        beyond = corners @ equations[:, :3].T + equations[:, 3]
        excess = beyond.max(axis=1) * _weights(corners + center, pads)
        worst = int(excess.argmax())
        if len(planes) == MAX_PLANES or excess[worst] < PRECISE:
            break
        planes = np.vstack([planes, equations[beyond[worst].argmax()]])
    solid = ConvexHull(corners)
    corners = corners[solid.vertices]
    size = np.concatenate([[len(planes), len(corners)], planes.ravel(), corners.ravel()])
    return Fit(CONVEX, size, pose_matrix(np.eye(3), center), float(solid.volume))


def _weights(points: Array, pads: list[Pad]) -> Array:
    """What it counts that a solid reaches to points (n, 3)."""
    weights = np.ones(len(points))
    for pad in pads:
        away = points - pad.center
        cosines = away @ pad.normal / np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        weights[cosines > np.cos(_max_angle(pad) + 0.3)] = BESIDE_PAD
    return weights


def _max_angle(pad: Pad) -> float:
    return PAD_ANGLE_LIMIT if pad.max_angle is None else pad.max_angle


def cone(normal: Array, angle: float) -> Array:
    """Unit vectors (n, 3) evenly spread over the directions within ``angle`` [rad] of a unit vector."""
    heights = 1 - (1 - np.cos(angle)) * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    turns = np.arange(DIRECTIONS) * np.pi * (3 - np.sqrt(5))
    across = np.sqrt(1 - heights**2)
    local = np.column_stack([across * np.cos(turns), across * np.sin(turns), heights])
    return np.asarray(local @ rotation_to_axis(normal).T)
