"""Points sorted by cubic cells: the search structure behind nearest points and collision."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["PointGrid"]


class PointGrid(NamedTuple):
    """Points in the order of their cells, so that a column of cells is one contiguous run of points.

    Attributes:
        points: The points, cell after cell, (n, 3) [m].
        starts: First point of each cell, one more than there are cells, int32.
        origin: Lowest corner of the first cell [m].
        shape: Number of cells along each axis.
        cell: Edge length of a cell [m].
    """

    points: NDArray[np.float64]
    starts: NDArray[np.int32]
    origin: tuple[float, float, float]
    shape: tuple[int, int, int]
    cell: float
