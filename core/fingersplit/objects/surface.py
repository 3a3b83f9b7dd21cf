"""The object's surface as the planner meets it: evenly spaced samples with outward normals, and the nearest point.

Neither accuracy nor time depends on how the mesh was triangulated: a query finds the nearest sample and continues on
that sample's tangent plane, or beside a crease on its triangle; ``touch`` refines to the triangles themselves.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.grid import PointGrid
from fingersplit.objects.grid_kernel import (
    build_grid,
    smooth_directions,
    thin_evenly,
)
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.scatter import scatter
from fingersplit.objects.surface_kernel import find_creases

__all__ = ["PACKING", "Surface", "sample_surface"]

TARGET_SAMPLES = 30_000
MIN_SPACING = 0.4e-3
"""[m]; small objects get fewer samples rather than closer ones."""
MIN_CELL = 3.5e-3
"""[m]; queries come from pad centres, a pad's radius away, and would visit too many smaller cells."""
PACKING = 0.52
"""Samples that thinning leaves on an area of spacing^2, with ``CANDIDATES_PER_SAMPLE`` to choose from."""
CANDIDATES_PER_SAMPLE = 6
SHARP_EDGE = math.radians(50.0)
"""[rad]; normals that differ by more belong to different sides of an edge and are not blended."""


class Surface(NamedTuple):
    """Surface samples for kernels.

    Attributes:
        grid: Sample positions (n, 3) [m] and their search structure.
        normals: Unit outward normals, smoothed but not across sharp edges, (n, 3).
        triangles: Corner points of the triangle each sample lies on, (n, 3, 3) [m].
        creased: Samples beside an edge or a tight curve, where the tangent plane leaves the surface, (n,).
        spacing: Least distance between two samples [m].
    """

    grid: PointGrid
    normals: NDArray[np.float64]
    triangles: NDArray[np.float64]
    creased: NDArray[np.bool_]
    spacing: float


def sample_surface(mesh: Mesh, detail: float = 0.0) -> Surface:
    """Cover a mesh evenly with about ``TARGET_SAMPLES`` samples; the same mesh always gives the same samples.

    Args:
        mesh: The triangles.
        detail: Samples need not stand closer than this [m].
    """
    spacing = max(math.sqrt(PACKING * mesh.area / TARGET_SAMPLES), MIN_SPACING, detail)
    count = int(CANDIDATES_PER_SAMPLE * PACKING * mesh.area / spacing**2)
    candidates, faces = scatter(mesh, count, np.random.default_rng(0))
    kept = thin_evenly(candidates, spacing)
    radius = 2.5 * spacing
    grid, order = build_grid(candidates[kept], max(radius, MIN_CELL))
    triangles = mesh.vertices[mesh.faces[faces[kept][order]]]
    flat_normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    flat_normals /= np.linalg.norm(flat_normals, axis=1, keepdims=True)
    normals = smooth_directions(grid, flat_normals, radius, math.cos(SHARP_EDGE))
    creased = find_creases(grid, normals, radius, spacing)
    for array in (grid.points, grid.starts, normals, triangles, creased):
        array.setflags(write=False)
    return Surface(grid, normals, triangles, creased, spacing)
