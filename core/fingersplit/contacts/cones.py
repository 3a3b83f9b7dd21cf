"""Friction cones as arrays, from the same tangents as the kernels' (``cone_kernel``)."""

import math

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.cone_kernel import FACETS, set_facets

__all__ = ["cone_cosine", "cone_edges", "facet_directions"]


def cone_cosine(friction: float) -> float:
    """Cosine of the half angle of a friction cone."""
    return math.cos(math.atan(friction))


def facet_directions(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (F, FACETS, 3) all around the normals (F, 3), which the facets of the cones look along."""
    directions = np.empty((len(normals), FACETS, 3))
    set_facets(normals, directions)
    return directions


def cone_edges(normals: NDArray[np.float64], friction: float) -> NDArray[np.float64]:
    """Forces along the edges of inscribed cones, into the object, normal part 1, (F, FACETS, 3).

    Args:
        normals: Outward surface normals at the contacts, (F, 3).
        friction: Coulomb friction coefficient.
    """
    return np.asarray(-normals[:, None] + friction * facet_directions(normals))
