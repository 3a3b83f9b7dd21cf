"""The shapes of links: the spheres that cover them, and their drawing meshes."""

import math

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.hands.shapes_kernel import CAPSULE, CONVEX, CYLINDER, SPHERE, shape_distance

__all__ = ["bounding_radius", "corners_of", "covering_spheres", "shape_mesh"]

_MIN_SIDE = 0.018
"""[m]; covering spheres of flat shapes are not made smaller than a cube of this side needs."""


def corners_of(size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (n, 3) of a convex solid in its own frame [m], from its numbers as ``shape_distance`` takes them."""
    first = 2 + 4 * int(size[0])
    return size[first : first + 3 * int(size[1])].reshape(-1, 3)


def bounding_radius(kind: int, size: NDArray[np.float64]) -> float:
    """Radius [m] of the sphere about a shape's centre that encloses it."""
    if kind == SPHERE:
        return float(size[0])
    if kind == CAPSULE:
        return float(size[0] + size[1])
    if kind == CONVEX:
        return float(np.linalg.norm(corners_of(size), axis=1).max())
    return float(np.linalg.norm(size[:2] if kind == CYLINDER else size[:3]))


def covering_spheres(kind: int, size: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, NDArray[np.float64]]:
    """Spheres that together enclose a shape, without reaching far beyond it.

    A capsule is cut along its axis, every other shape's bounding box into nearly cubic bricks.

    Returns:
        Centres (n, 3), the radius with which they enclose the shape, and radii (n,) with which they lie inside it [m].
    """
    if kind == SPHERE:
        return np.zeros((1, 3)), float(size[0]), size[:1]
    if kind == CAPSULE:
        count = max(2, math.ceil(size[1] / size[0]))
        heights = size[1] * np.linspace(-1, 1, count)
        centers = np.column_stack([np.zeros(count), np.zeros(count), heights])
        return centers, math.hypot(size[0], size[1] / (count - 1)), np.full(count, size[0])
    half = np.abs(corners_of(size)).max(axis=0) if kind == CONVEX else size[:3]
    if kind == CYLINDER:
        half = np.array([size[0], size[0], size[1]])
    side = max(2 * half.min(), _MIN_SIDE)
    counts = np.maximum(np.ceil(2 * half / (1.2 * side)).astype(int), 1)
    axes = [h * (2 * np.arange(n) + 1 - n) / n for h, n in zip(half, counts, strict=True)]
    centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    insides = np.full(len(centers), (half / counts).min())
    if kind == CYLINDER:  # bricks at the corners of its box reach outside
        insides = np.clip(size[0] - np.linalg.norm(centers[:, :2], axis=1), 0.0, insides)
    if kind == CONVEX:
        insides = np.maximum([-shape_distance(kind, size, *center) for center in centers], 0.0)
    radius = bounding_radius(kind, size) if len(centers) == 1 else float(np.linalg.norm(half / counts))
    return centers, radius, insides


def shape_mesh(kind: int, size: NDArray[np.float64]) -> trimesh.Trimesh:
    """Closed triangle mesh of a shape in its own frame, for drawing."""
    if kind == SPHERE:
        return trimesh.creation.icosphere(subdivisions=3, radius=size[0])
    if kind == CAPSULE:
        return trimesh.creation.capsule(height=2 * size[1], radius=size[0], count=[24, 24])
    if kind == CYLINDER:
        return trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=48)
    if kind == CONVEX:
        return trimesh.convex.convex_hull(corners_of(size))
    return trimesh.creation.box(extents=2 * size[:3])
