"""Kernels over many points: those of obstacles before they are sorted into a grid, and the object's vertices."""

import numpy as np

from fingersplit.compilation import kernel

__all__ = ["bounds_of", "least_along", "points_within"]


@kernel
def points_within(points, pose, center, reach):
    """Points (n, 3) [m] moved by a pose (4, 4), of these the ones within ``reach`` [m] of ``center``, (m, 3)."""
    kept, count = np.empty((len(points), 3)), 0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        squared = 0.0
        for k in range(3):
            place = pose[k, 0] * x + pose[k, 1] * y + pose[k, 2] * z + pose[k, 3]
            kept[count, k] = place
            squared += (place - center[k]) ** 2
        if squared <= reach * reach:
            count += 1
    return kept[:count]


@kernel
def bounds_of(points):
    """Least and greatest coordinates of points (n, 3), (2, 3)."""
    bounds = np.empty((2, 3))
    bounds[0], bounds[1] = points[0], points[0]
    for i in range(1, len(points)):
        for k in range(3):
            bounds[0, k] = min(bounds[0, k], points[i, k])
            bounds[1, k] = max(bounds[1, k], points[i, k])
    return bounds


@kernel
def least_along(points, direction):
    """Least coordinate of points (n, 3) along a direction (3,)."""
    least = np.inf
    for i in range(len(points)):
        along = points[i, 0] * direction[0] + points[i, 1] * direction[1] + points[i, 2] * direction[2]
        least = min(least, along)
    return least
