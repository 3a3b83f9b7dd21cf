"""Points of the object that a recording shows: those inside the hand, and those that CPO aims at."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.hands.hand import Hand
from fingersplit.hands.shapes import shape_distance
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.surface import closest
from fingersplit.vectors import get, norm, put, rotate_back, subtract

__all__ = ["hit_points", "reference_points"]


def hit_points(
    hand: Hand, model: ObjectModel, rotations: NDArray[np.float64], positions: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Collision points of the object that lie inside the hand, for every pose of its primitives.

    Args:
        hand: The hand.
        model: The object.
        rotations: ``object_from_shape``, (T, K, 3, 3).
        positions: Shape centres, (T, K, 3) [m].

    Returns:
        For each pose the points inside, (n, 3) [m].
    """
    points = model.collision.points
    inside = np.zeros((len(rotations), len(points)), dtype=np.bool_)
    count = hand.arrays.shape_count
    kinds, sizes = hand.arrays.shape_kinds[:count], hand.arrays.shape_sizes[:count]
    _mark_inside(kinds, sizes, rotations, positions, points, inside)
    return [points[row] for row in inside]


def reference_points(model: ObjectModel, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The surface point nearest to each of ``points`` (n, 3) [m], (n, 3) [m]."""
    found = np.empty_like(points)
    _nearest_points(model.surface, np.ascontiguousarray(points), found)
    return found


@kernel
def _mark_inside(kinds, sizes, rotations, positions, points, inside):
    for row in range(len(rotations)):
        for k in range(kinds.size):
            center, reach = get(positions[row], k), sizes[k].sum()  # encloses the shape, whatever its kind
            for i in range(len(points)):
                offset = subtract(get(points, i), center)
                if not inside[row, i] and norm(offset) < reach:
                    x, y, z = rotate_back(rotations[row, k], offset)
                    inside[row, i] = shape_distance(kinds[k], sizes[k], x, y, z) < 0.0


@kernel
def _nearest_points(surface, points, found):
    for i in range(len(points)):
        _, point, _ = closest(surface, get(points, i), -1)
        put(found, i, point)
