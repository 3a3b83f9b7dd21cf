"""Random points spread over a triangle surface."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.scatter_kernel import put_points

__all__ = ["scatter"]


def scatter(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points on a mesh in random order, one in each ``count``-th of its area.

    Returns:
        The points, (count, 3) [m], and the face that each lies on, (count,).
    """
    places = (rng.permutation(count) + rng.random(count)) * (mesh.area / count)
    points, faces = np.empty((count, 3)), np.empty(count, np.int64)
    order = np.argsort(places)
    put_points(mesh.vertices, mesh.faces, places, order, rng.random((count, 2)), points, faces)
    return points, faces
