"""From many ranked pairs of contacts to few that cover the object."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.vectors import get, norm, subtract

__all__ = ["spread_pairs"]

CLOSING_IN = 0.7
"""Factor from one least distance to the next."""


@kernel
def spread_pairs(first, second, count, widest, narrowest):
    """Indices of at most ``count`` pairs that differ, in their given order, which is best first.

    Best first as long as they are ``widest`` apart; then closer and closer ones fill the gaps. So the best of every
    region is in before the second best of any, and near doubles never are.

    Args:
        first: One contact of each pair, (n, 3) [m].
        second: The other, (n, 3) [m].
        count: Most pairs to choose.
        widest: Distance between pairs that the first choice keeps [m].
        narrowest: Distance that no two chosen pairs fall below [m].
    """
    chosen, gaps = np.zeros(len(first), np.bool_), np.full(len(first), math.inf)
    found, least = 0, widest
    while found < count and least >= narrowest:
        for i in range(len(first)):
            if found < count and gaps[i] >= least:
                chosen[i] = True
                found += 1
                for j in range(len(first)):
                    gaps[j] = min(gaps[j], _distance(first, second, i, j))
        least *= CLOSING_IN
    return np.nonzero(chosen)[0]


@kernel
def _distance(first, second, i, j):
    """Mean distance of the contacts of two pairs, whichever way round [m]."""
    a, b, c, d = get(first, i), get(second, i), get(first, j), get(second, j)
    straight = norm(subtract(a, c)) + norm(subtract(b, d))
    swapped = norm(subtract(a, d)) + norm(subtract(b, c))
    return 0.5 * min(straight, swapped)
