"""From many ranked pairs of contacts to few that cover the object."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, get, norm, subtract

__all__ = ["COVERING", "spread_pairs"]

COVERING = (0.5, 0.1, 0.02)
"""Distances for ``spread_pairs`` as shares of an object's radius: one pair for every region, then the best ones as long
as they differ clearly, then at all."""


@kernel
def spread_pairs(first, second, count, distances):
    """Indices of at most ``count`` pairs that differ, in their given order, which is best first.

    Best first as long as they are the first of ``distances`` apart, then the second, and so on: the best of every
    region is in before the second best of any, and near doubles never are.

    Args:
        first: One contact of each pair, (n, 3) [m].
        second: The other, (n, 3) [m].
        count: Most pairs to choose.
        distances: Least distances between chosen pairs, falling; none comes nearer to another than the last [m].
    """
    chosen, gaps, found = np.zeros(len(first), np.bool_), np.full(len(first), math.inf), 0
    for least in distances:
        for i in range(len(first)):
            if found < count and gaps[i] >= least:
                chosen[i] = True
                found += 1
                for j in range(len(first)):
                    if _least_distance(first, second, i, j) < gaps[j]:
                        gaps[j] = min(gaps[j], _distance(first, second, i, j))
    return np.nonzero(chosen)[0]


@kernel
def _least_distance(first, second, i, j):
    """Distance of the middles of two pairs [m], which is never more than their mean distance and quickly found."""
    a, b, c, d = get(first, i), get(second, i), get(first, j), get(second, j)
    return 0.5 * norm(subtract(add(a, b), add(c, d)))


@kernel
def _distance(first, second, i, j):
    """Mean distance of the contacts of two pairs, whichever way round [m]."""
    a, b, c, d = get(first, i), get(second, i), get(first, j), get(second, j)
    straight = norm(subtract(a, c)) + norm(subtract(b, d))
    swapped = norm(subtract(a, d)) + norm(subtract(b, c))
    return 0.5 * min(straight, swapped)
