"""Kernel of `polygons`: whether a polygon crosses itself."""

import numpy as np

from fingersplit.compilation import kernel

__all__ = ["crosses_itself"]

_TOUCH = 1e-9  # of the squared size; corners this near to a side touch it and do not cross it


@kernel
def crosses_itself(points):
    """The first two sides of a polygon (n, 2) that cross, each by the number of its first corner, or (-1, -1).

    Sides that touch or run along each other do not cross, such as those that lead to a hole and back. By a sweep along
    x: sides are compared with those that begin before they end.
    """
    n = len(points)
    low, high = np.empty(n), np.empty(n)
    size = 0.0
    for i in range(n):
        j = (i + 1) % n
        low[i], high[i] = min(points[i, 0], points[j, 0]), max(points[i, 0], points[j, 0])
        size = max(size, abs(points[i, 0]), abs(points[i, 1]))
    order = np.argsort(low)
    least = _TOUCH * size * size
    for k in range(n):
        i = order[k]
        for m in range(k + 1, n):
            j = order[m]
            if low[j] > high[i]:
                break
            a, b, c, d = points[i], points[(i + 1) % n], points[j], points[(j + 1) % n]
            one, other = _side(a, b, c), _side(a, b, d)
            if abs(one) > least and abs(other) > least and (one > 0.0) != (other > 0.0):
                one, other = _side(c, d, a), _side(c, d, b)
                if abs(one) > least and abs(other) > least and (one > 0.0) != (other > 0.0):
                    return min(i, j), max(i, j)
    return -1, -1


@kernel
def _side(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
