"""The friction cone of a contact, and the pyramid of ``FACETS`` facets that stands for it.

Every pyramid of the planner has the same facets: those of the margin, of the grip, and, with its edges where these have
their facets, of Ferrari-Canny.
"""

import math

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, cross, get, norm, put, scale

__all__ = ["FACETS", "INSCRIBED", "facet", "set_facets", "tangents"]

FACETS = 8
"""Facets, and edges, of the pyramid that stands for a friction cone."""
INSCRIBED = math.cos(math.pi / FACETS)
"""Share of the friction that the facets of the pyramid inscribed in the cone have."""


@kernel
def tangents(normal):
    """Two unit vectors that span the plane across a unit vector."""
    first = cross(normal, (1.0, 0.0, 0.0) if abs(normal[0]) < 0.7 else (0.0, 1.0, 0.0))
    first = scale(1.0 / norm(first), first)
    return first, cross(normal, first)


@kernel
def facet(first, second, k):
    """Direction across the contact that facet ``k`` looks along, a unit vector between two ``tangents``."""
    angle = 2.0 * math.pi * k / FACETS
    return add(scale(math.cos(angle), first), scale(math.sin(angle), second))


@kernel
def set_facets(normals, directions):
    """Write ``facet`` of every facet of contacts with outward ``normals`` (F, 3) into ``directions`` (F, FACETS, 3)."""
    for f in range(len(normals)):
        first, second = tangents(scale(-1.0, get(normals, f)))
        for k in range(FACETS):
            put(directions[f], k, facet(first, second, k))
