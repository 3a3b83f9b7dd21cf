"""The primitive shapes of links: their drawing meshes and their signed distance."""

import math

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.compilation import kernel

__all__ = ["BOX", "CAPSULE", "CYLINDER", "SPHERE", "bounding_radius", "shape_distance", "shape_mesh"]

# The numbers are those of mujoco.mjtGeom.
SPHERE = 2
CAPSULE = 3
CYLINDER = 5
BOX = 6


@kernel
def shape_distance(kind, size, x, y, z):
    """Signed distance [m] from a point in the shape's frame to its surface, negative inside.

    Sizes as in MJCF: sphere (radius), capsule and cylinder along z (radius, half length), box (half edges).
    """
    if kind == SPHERE:
        return math.sqrt(x * x + y * y + z * z) - size[0]
    if kind == CAPSULE:
        beyond = max(abs(z) - size[1], 0.0)
        return math.sqrt(x * x + y * y + beyond * beyond) - size[0]
    if kind == CYLINDER:
        a, b, c = math.sqrt(x * x + y * y) - size[0], abs(z) - size[1], -math.inf
    else:
        a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    inside = min(max(a, b, c), 0.0)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return inside + math.sqrt(a * a + b * b + c * c)


@kernel
def bounding_radius(kind, size):
    """Radius [m] of the sphere about the shape's centre that encloses it."""
    if kind == SPHERE:
        return size[0]
    if kind == CAPSULE:
        return size[0] + size[1]
    if kind == CYLINDER:
        return math.sqrt(size[0] * size[0] + size[1] * size[1])
    return math.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2])


def shape_mesh(kind: int, size: NDArray[np.float64]) -> trimesh.Trimesh:
    """Closed triangle mesh of a shape in its own frame, for drawing."""
    if kind == SPHERE:
        return trimesh.creation.icosphere(subdivisions=3, radius=size[0])
    if kind == CAPSULE:
        return trimesh.creation.capsule(height=2 * size[1], radius=size[0], count=[24, 24])
    if kind == CYLINDER:
        return trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=48)
    return trimesh.creation.box(extents=2 * size)
