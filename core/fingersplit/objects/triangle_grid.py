"""Triangles binned in cubic cells: exact rays without a tree that takes longer to build than to use."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.triangle_grid_kernel import MARGIN, fill_cells

__all__ = ["TriangleGrid", "bin_triangles"]

CELLS_PER_TRIANGLE = 4.0
MIN_SHARE = 1 / 256
"""Least edge of a cell as a share of the longest side of the bounding box."""


class TriangleGrid(NamedTuple):
    """The triangles of a mesh by cell; a triangle stands in every cell that its bounding box meets.

    Attributes:
        vertices: Corner points, (n_vertices, 3) [m].
        faces: Vertex indices, counter-clockwise seen from outside, (n_faces, 3) int32.
        starts: First entry of each cell in ``members``, one more than there are cells, int32.
        members: Face indices, cell after cell, int32.
        origin: Lowest corner of the first cell [m].
        shape: Number of cells along each axis.
        cell: Edge length of a cell [m].
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    starts: NDArray[np.int32]
    members: NDArray[np.int32]
    origin: tuple[float, float, float]
    shape: tuple[int, int, int]
    cell: float


def bin_triangles(mesh: Mesh) -> TriangleGrid:
    """Bin a mesh's triangles; the arrays are read-only."""
    sides = mesh.extents
    longest = float(sides.max())
    volume = float(np.maximum(sides, 0.01 * longest).prod())
    cell = max((volume / (CELLS_PER_TRIANGLE * len(mesh.faces))) ** (1 / 3), MIN_SHARE * longest)
    x, y, z = (mesh.bounds[0] - MARGIN * cell).tolist()
    nx, ny, nz = (np.floor(sides / cell + 2 * MARGIN).astype(np.int64) + 1).tolist()
    starts, members = fill_cells(mesh.vertices, mesh.faces, (x, y, z), cell, (nx, ny, nz))
    for array in (starts, members):
        array.setflags(write=False)
    return TriangleGrid(mesh.vertices, mesh.faces, starts, members, (x, y, z), (nx, ny, nz), cell)
