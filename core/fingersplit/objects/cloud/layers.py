"""Planes through the neighbourhoods of points, also where both sides of a thin wall lie in one neighbourhood."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Planes", "fit_layers", "fit_planes"]

LAYERED, LAYERED_OF_MANY = 0.2, 0.25
"""Share of the variance across a neighbourhood that two layers may leave; one layer leaves 0.25 to 0.36."""
MANY = 50
"""Neighbours from which the latter holds: shares of few vary more."""
MOSTLY_LAYERED = 0.15
"""Share of neighbourhoods with two layers from which an object is thin-walled; by chance it is 0.02."""
NEAREST = 9
"""Neighbours that the second of two tries starts from: they are on one side of a wall most often."""
ROUNDS = 2


class Planes(NamedTuple):
    """Planes through neighbourhoods.

    Attributes:
        normals: Unit normals, whichever way round, (n, 3).
        areas: Area for one point in each, (n,) [m^2].
        noise: Typical deviation of points from their plane [m].
    """

    normals: NDArray[np.float64]
    areas: NDArray[np.float64]
    noise: float


def fit_planes(
    points: NDArray[np.float64],
    neighbours: NDArray[np.integer],
    counted: NDArray[np.bool_] | None = None,
    telling: NDArray[np.bool_] | None = None,
) -> Planes:
    """The planes that fit the counted neighbours of every point best.

    Args:
        points: (n, 3) [m].
        neighbours: Numbers of points, (n, k).
        counted: Which of them to fit, (n, k); None for all.
        telling: Which neighbourhoods tell the noise, (n,); None for all.
    """
    offsets = points[neighbours]
    if counted is None:
        number = np.full(len(points), neighbours.shape[1])
        offsets = offsets - offsets.mean(axis=1, keepdims=True)
    else:
        number = np.maximum(counted.sum(axis=1), 1)
        means = np.einsum("ijk,ij->ik", offsets, counted) / number[:, None]
        offsets = (offsets - means[:, None]) * counted[..., None]
    spreads, axes = np.linalg.eigh(offsets.transpose(0, 2, 1) @ offsets / number[:, None, None])
    told = spreads[:, 0] if telling is None else spreads[telling, 0]
    noise = float(np.sqrt(np.median(np.maximum(told, 0.0))))
    # An even disk of radius r has the variance r^2 / 4 along each axis.
    areas = 4 * np.pi * np.sqrt(np.maximum(spreads[:, 1] * spreads[:, 2], 0.0)) / number
    return Planes(axes[:, :, 0], areas, noise)


def fit_layers(points: NDArray[np.float64], neighbours: NDArray[np.integer]) -> Planes:
    """The planes that fit neighbours best, those on a point's own side only where they lie in two layers.

    So they do about a thin wall. Where that is so often enough, the noise is that of these neighbourhoods: the others
    may hold both sides of a wall unrecognised.

    Args:
        points: (n, 3) [m].
        neighbours: Numbers of points, (n, k), every point its own first.
    """
    count = neighbours.shape[1]
    offsets = points[neighbours]
    offsets = offsets - offsets.mean(axis=1, keepdims=True)
    nearest = offsets[:, :NEAREST] - offsets[:, :NEAREST].mean(axis=1, keepdims=True)
    first, second = (_split(offsets, _smallest_axes(start)) for start in (offsets, nearest))
    above = np.where((first.share <= second.share)[:, None], first.above, second.above)
    n_above = above.sum(axis=1)
    layered = np.minimum(first.share, second.share) < (LAYERED_OF_MANY if count > MANY else LAYERED)
    layered &= (n_above >= 3) & (count - n_above >= 3)
    own = (above == above[:, :1]) | ~layered[:, None]
    return fit_planes(points, neighbours, own, layered if layered.mean() > MOSTLY_LAYERED else None)


class _Split(NamedTuple):
    """Neighbours above the middle of a neighbourhood (n, k), and the share of its variance across that is left (n,)."""

    above: NDArray[np.bool_]
    share: NDArray[np.float64]


def _split(offsets: NDArray[np.float64], normals: NDArray[np.float64]) -> _Split:
    """Split neighbourhoods with offsets (n, k, 3) from their means into two parallel planes, from first normals on."""
    for _ in range(ROUNDS):  # sides by heights, then the normal from both sides
        above = np.einsum("ijk,ik->ij", offsets, normals) > 0
        n_above = above.sum(axis=1)
        sums = np.einsum("ijk,ij->ik", offsets, above)  # below, it is the same with the other sign
        upper = sums / np.maximum(n_above, 1)[:, None]
        lower = -sums / np.maximum(offsets.shape[1] - n_above, 1)[:, None]
        from_layer = offsets - np.where(above[..., None], upper[:, None], lower[:, None])
        normals = _smallest_axes(from_layer)
    within, total = ((np.einsum("ijk,ik->ij", part, normals) ** 2).sum(axis=1) for part in (from_layer, offsets))
    return _Split(above, within / np.maximum(total, 1e-30))


def _smallest_axes(offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions (n, 3) along which offsets (n, k, 3) spread least."""
    return np.asarray(np.linalg.eigh(offsets.transpose(0, 2, 1) @ offsets)[1][:, :, 0])
