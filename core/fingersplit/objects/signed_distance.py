"""Signed distance to the object on a regular grid: culls collision tests and pushes links away.

Distances are those to the nearest surface samples and, near the surface, to their triangles. The sign is a vote of the
rays that run from a grid point along the axes: each tells how often the surface, with its holes closed as in `Solid`,
encloses the point [Nooruddin2003]. They agree but for rays through an edge.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.signed_distance_kernel import MARGIN, count_enclosures, finish, spread_samples
from fingersplit.objects.surface import Surface

__all__ = ["DistanceGrid", "build_distance_grid"]

CELLS = 96
"""Along the longest side, the margin included; about 64 of them lie on an object of 16 cm."""


class DistanceGrid(NamedTuple):
    """Signed distances at the corners of cubic cells.

    Attributes:
        values: Distance to the surface, negative inside, (nx, ny, nz) float32 [m].
        samples: Nearest surface sample where contacts may be, or nearly so, (nx, ny, nz) int32.
        origin: Place of ``values[0, 0, 0]`` [m].
        cell: Edge length of a cell [m].
    """

    values: NDArray[np.float32]
    samples: NDArray[np.int32]
    origin: tuple[float, float, float]
    cell: float


def build_distance_grid(mesh: Mesh, surface: Surface, touchable: Surface | None = None) -> DistanceGrid:
    """Signed distances about a mesh, out to ``MARGIN`` from its bounding box.

    Args:
        mesh: Open or closed, its faces turned outwards.
        surface: Samples of it.
        touchable: The samples to name beside the distances, if they are others.
    """
    low, high = mesh.bounds + np.array([[-MARGIN], [MARGIN]])
    cell = float((high - low).max() / CELLS)
    shape = tuple((np.ceil((high - low) / cell).astype(np.int64) + 1).tolist())
    x, y, z = low.tolist()
    nearest, values = np.full(shape, -1, np.int32), np.full(shape, np.inf, np.float32)
    spread_samples(surface.grid.points, (x, y, z), cell, nearest, values)
    votes = np.zeros(shape, np.int8)
    triangles = mesh.solid.vertices[mesh.solid.faces]
    for axis in range(3):
        count_enclosures(triangles, axis, low, cell, votes)
    samples = surface.grid.points, surface.normals, surface.triangles
    finish(*samples, (x, y, z), cell, nearest, votes, values)
    if touchable is not None:
        nearest[:] = -1
        spread_samples(touchable.grid.points, (x, y, z), cell, nearest, np.full(shape, np.inf, np.float32))
    for array in (values, nearest):
        array.setflags(write=False)
    return DistanceGrid(values, nearest, (x, y, z), cell)
