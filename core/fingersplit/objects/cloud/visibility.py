"""From which side of their own planes points can be seen, and whether they close off a body.

The points are looked at along many axes, from both ends of each. On a closed surface a point is seen from outside only;
the points of a sheet, and of what one camera saw, are seen from both sides.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Visibility", "look_from_all_sides"]

AXES = 30
"""Looked along, from both ends of each."""
PIXEL = 2.0
"""[spacings]; with narrower ones, chance leaves holes in a surface of evenly spread points."""
MIN_COSINE = 0.4
"""Between a normal and an axis; flatter views say little of what lies before what."""
BEFORE = 0.3, 3.0
"""Height above a point's plane from which another one hides it, in spacings and in standard deviations of the noise."""


class Visibility(NamedTuple):
    """How often points are seen.

    Attributes:
        front: How often a point is seen from the side that its normal points to, (n,), 0 to 1: the share of all views
            from that side, weighted by how straight they look at it.
        back: The same from the other side.
        openness: Views from a point's lesser side by those from its greater one, 0 for a closed surface to 1 for a
            sheet.
    """

    front: NDArray[np.float64]
    back: NDArray[np.float64]
    openness: float


def look_from_all_sides(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    areas: NDArray[np.float64],
    spacing: float,
    noise: float,
) -> Visibility:
    """Look at points from all sides, and count for each of them from which side of its own plane it is seen.

    Args:
        points: (n, 3) [m].
        normals: Unit normals, (n, 3), whichever way round.
        areas: Surface area that each point stands for, (n,) [m^2].
        spacing: Typical distance of neighbouring points [m].
        noise: Standard deviation of the points across the surface [m].
    """
    front, back, possible = np.zeros((3, len(points)))
    before = BEFORE[0] * spacing + BEFORE[1] * noise
    for axis in _axes():
        cosines = normals @ axis
        weights = np.where(np.abs(cosines) > MIN_COSINE, np.abs(cosines), 0.0)
        for outermost, towards in zip(_outermost(points, axis, PIXEL * spacing), (1.0, -1.0), strict=True):
            heights = np.einsum("ij,ij->i", points[outermost] - points, normals)
            faces = cosines * towards > 0
            seen = np.where(np.where(faces, heights, -heights) < before, weights, 0.0)
            front += np.where(faces, seen, 0.0)
            back += np.where(faces, 0.0, seen)
        possible += weights
    lesser, greater = np.minimum(front, back), np.maximum(front, back)
    openness = float(areas @ lesser) / max(float(areas @ greater), 1e-30)
    possible = np.maximum(possible, 1e-9)
    return Visibility(front / possible, back / possible, openness)


def _axes() -> NDArray[np.float64]:
    """Axes spread evenly over half of all directions, (AXES, 3): a spiral of golden angles."""
    heights = (np.arange(AXES) + 0.5) / AXES
    angles = np.pi * (3 - np.sqrt(5)) * np.arange(AXES)
    radii = np.sqrt(1 - heights**2)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles), heights])


def _outermost(
    points: NDArray[np.float64], axis: NDArray[np.float64], pixel: float
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Numbers of the highest and of the lowest point along an axis in every point's pixel, (n,) each."""
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    flat = points @ np.column_stack([side, np.cross(axis, side)])
    cells = ((flat - flat.min(axis=0)) / pixel).astype(np.int64)
    number = cells[:, 0] * (int(cells[:, 1].max()) + 1) + cells[:, 1]
    upwards = np.argsort(points @ axis)
    highest, lowest = np.zeros((2, int(number.max()) + 1), np.int64)
    highest[number[upwards]] = upwards  # the last one stays
    lowest[number[upwards[::-1]]] = upwards[::-1]
    return highest[number], lowest[number]
