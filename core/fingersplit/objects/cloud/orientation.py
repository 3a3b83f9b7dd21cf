"""Which way is out, judged from the shape of the points alone."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from fingersplit.objects.cloud.layers import Planes
from fingersplit.objects.cloud.visibility import Visibility, look_from_all_sides

__all__ = ["orient_closed", "orient_open"]

OPEN = 0.2
"""Openness (`Visibility`) from which points close off no body."""
FEW_VIEWS = 0.2
"""Share of all views that must have seen a point for its side to be sure."""
IN_PLANE = 0.3
"""Sine of the direction to a neighbour above a point's plane from which it may be on the other side of a wall."""
OWN_VIEWS, TELLINGS = 0.3, 80
"""Weight of a point's views beside what all neighbours say, and how often these tell it."""


def orient_closed(
    points: NDArray[np.float64], planes: Planes, neighbours: NDArray[np.integer]
) -> NDArray[np.float64] | None:
    """Normals (n, 3) that point out of the body that points close off; None if they close off none.

    Args:
        points: (n, 3) [m].
        planes: Through the neighbourhood of each.
        neighbours: The nearest of them, (n, k), every point its own first.
    """
    spacing = float(np.sqrt(np.median(planes.areas)))
    seen = look_from_all_sides(points, planes.normals, planes.areas, spacing, planes.noise)
    if seen.openness > OPEN:
        return None
    return planes.normals * _as_seen(points, planes.normals, neighbours, seen)[:, None]


def _as_seen(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    neighbours: NDArray[np.integer],
    seen: Visibility,
) -> NDArray[np.float64]:
    """Signs (n,) of normals: the side that points are seen from, and where few saw them what their neighbours say.

    Every point goes again and again by its own views and by the neighbours in its plane, until those that many saw
    have told the others, as the wall deep in a cup.
    """
    n = len(points)
    rows, columns = np.repeat(np.arange(n), neighbours.shape[1] - 1), neighbours[:, 1:].ravel()
    offsets = points[columns] - points[rows]
    heights = np.abs(np.einsum("ij,ij->i", offsets, normals[rows]))
    across = heights / np.maximum(np.linalg.norm(offsets, axis=1), 1e-12)
    weights = np.exp(-((across / IN_PLANE) ** 2))
    total = np.maximum(np.bincount(rows, weights, n), 1e-3)
    cosines = np.einsum("ij,ij->i", normals[rows], normals[columns])
    told = coo_array((weights * cosines / total[rows], (rows, columns)), shape=(n, n)).tocsr()
    surplus = seen.front - seen.back
    views = surplus / np.maximum(seen.front + seen.back, FEW_VIEWS)
    leaning = views
    for _ in range(TELLINGS):
        leaning = np.clip(2 * (OWN_VIEWS * views + told @ leaning), -1.0, 1.0)
    return np.where(leaning < 0, -1.0, 1.0)


def orient_open(
    points: NDArray[np.float64], normals: NDArray[np.float64], neighbours: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Normals (n, 3) of points that close off no body, as those that one camera saw, turned out of the object.

    They agree with their neighbours along the tree of least turns [Hoppe1992], and the whole points away from its
    middle, unless neighbours agree better when all point to one side.
    """
    rows, columns = np.repeat(np.arange(len(points)), neighbours.shape[1] - 1), neighbours[:, 1:].ravel()
    cosines = np.einsum("ij,ij->i", normals[rows], normals[columns])

    def disagreement(signs: NDArray[np.float64]) -> float:
        return float(np.maximum(-signs[rows] * signs[columns] * cosines, 0).sum())

    signs = _spread_signs(points, normals, rows, columns, cosines)
    one_sided = signs
    for _ in range(3):
        one_sided = np.where(normals @ (one_sided @ normals) < 0, -1.0, 1.0)
    best = signs if disagreement(signs) <= disagreement(one_sided) else one_sided
    return normals * best[:, None]


def _spread_signs(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    rows: NDArray[np.integer],
    columns: NDArray[np.integer],
    cosines: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Signs (n,) that agree along the spanning tree of least turns, every part of it away from the middle."""
    n = len(points)
    links = coo_array((1 - np.abs(cosines) + 1e-6, (rows, columns)), shape=(n, n)).tocsr()
    tree = minimum_spanning_tree(links)
    n_parts, part = connected_components(tree, directed=False)
    signs = np.ones(n)
    away = np.einsum("ij,ij->i", points - points.mean(axis=0), normals)
    for number in range(n_parts):
        members = np.flatnonzero(part == number)
        order, before = breadth_first_order(tree, members[0], directed=False)
        agree = np.where(np.einsum("ij,ij->i", normals[order[1:]], normals[before[order[1:]]]) < 0, -1.0, 1.0)
        for i, sign in zip(order[1:], agree, strict=True):
            signs[i] = sign * signs[before[i]]
        if signs[members] @ away[members] < 0:
            signs[members] *= -1
    return signs
