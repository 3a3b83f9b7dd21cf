"""Which triangles lie about each surface sample, and how far they reach: samples then speak for the whole surface."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.grid import PointGrid
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.patches_kernel import share_out
from fingersplit.objects.surface import Surface

__all__ = ["Patches", "build_patches"]


class Patches(NamedTuple):
    """A mesh's surface as patches, one a sample; a triangle stands in the list of every patch that has a piece of it.

    Attributes:
        grid: The samples (n, 3) [m].
        normals: Their outward unit normals, (n, 3).
        vertices: Corner points of the mesh, (n_vertices, 3) [m].
        faces: Vertex indices, (n_faces, 3) int32.
        starts: First entry of each sample in ``members``, one more than there are samples, int32.
        members: Face indices, patch after patch, int32.
        reaches: Farthest that each patch goes from its sample, (n,) [m].
        plane_deviations: Farthest that each patch goes from its sample's tangent plane, (n,) [m].
        longest_reach: The greatest of ``reaches`` [m].
    """

    grid: PointGrid
    normals: NDArray[np.float64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    starts: NDArray[np.int32]
    members: NDArray[np.int32]
    reaches: NDArray[np.float64]
    plane_deviations: NDArray[np.float64]
    longest_reach: float


def build_patches(mesh: Mesh, surface: Surface) -> Patches:
    """Share out a mesh's triangles among its samples; the arrays are read-only."""
    starts, members, reaches, plane_deviations = share_out(mesh.vertices, mesh.faces, surface)
    for array in (starts, members, reaches, plane_deviations):
        array.setflags(write=False)
    shares = starts, members, reaches, plane_deviations, float(reaches.max())
    return Patches(surface.grid, surface.normals, mesh.vertices, mesh.faces, *shares)
