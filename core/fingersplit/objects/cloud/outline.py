"""What a shape becomes before it is sampled: a closed surface, and the part of it that is known."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.cloud.normals import OrientedPoints
from fingersplit.objects.mesh import Mesh

__all__ = ["Outline"]


class Outline(NamedTuple):
    """The outline of an object.

    Attributes:
        closed: All of the surface.
        seen: The part of it that carries contacts; the same mesh where all of it is known.
        viewpoint: Where the camera stood that saw the part, (3,) [m]; None where nothing hides behind it.
        detail: What the shape resolves [m]; samples need not stand closer. 0 for a mesh.
        shown: The points that show what was seen, where the rest of the surface that carries contacts is assumed; None
            where nothing is.
    """

    closed: Mesh
    seen: Mesh
    viewpoint: NDArray[np.float64] | None
    detail: float = 0.0
    shown: OrientedPoints | None = None
