"""A smooth implicit surface of an object: the cubic B-spline of its signed distance on a grid."""

from dataclasses import dataclass
from time import perf_counter

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter
from scipy.spatial import KDTree

from fingersplit.objects.model import ObjectModel

__all__ = ["ImplicitSurface", "fit_surface", "signed_distance"]

NODES = 200_000
"""Of the grid within the object's bounds, about; the pitch follows."""
NEIGHBOURS = 6
"""Samples that decide whether a point is inside."""
MARGIN = 4
"""Grid nodes beyond the object's bounds on every side: room for the search, and for the spline's border."""


@dataclass(frozen=True, eq=False)
class ImplicitSurface:
    """Zero set of a smooth function.

    Attributes:
        distance: CasADi function from a point (3,) [m] to its signed distance [m], positive outside.
        lower: Lowest corner of the box in which it may be asked, (3,) [m].
        upper: Highest corner, (3,) [m].
        pitch: Distance between grid nodes [m].
        seconds: Time that the fit took [s].
    """

    distance: casadi.Function
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    pitch: float
    seconds: float


def fit_surface(model: ObjectModel, nodes: int = NODES) -> ImplicitSurface:
    """Fit the surface of an object on a grid of about ``nodes``; details finer than its pitch are rounded off."""
    began = perf_counter()
    bounds = model.mesh.bounds
    pitch = float((np.prod(model.mesh.extents) / nodes) ** (1 / 3))
    shape = np.ceil(model.mesh.extents / pitch).astype(int) + 1 + 2 * MARGIN
    origin = bounds.mean(axis=0) - pitch * (shape - 1) / 2
    places = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    values = signed_distance(model, origin + pitch * places).reshape(shape)
    coefficients = spline_filter(values, order=3)
    # Coefficient i belongs to the basis function about node i, which reaches two nodes to either side.
    knots = [(origin[axis] + pitch * (np.arange(shape[axis] + 4) - 2)).tolist() for axis in range(3)]
    distance = casadi.Function.bspline("distance", knots, coefficients.ravel(order="F").tolist(), [3, 3, 3], 1)
    border = 2 * pitch
    return ImplicitSurface(
        distance, origin + border, origin + pitch * (shape - 1) - border, pitch, perf_counter() - began
    )


def signed_distance(model: ObjectModel, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of points (n, 3) [m] from the object's surface, negative inside, (n,) [m].

    Measured to the nearest surface sample and the disc about it, one sample spacing wide, on its tangent plane. Beyond
    an edge a point may lie below the nearest sample's plane and yet outside, so several samples decide on the sign.
    """
    surface = model.surface
    distances, nearest = KDTree(surface.grid.points).query(points, k=NEIGHBOURS)
    offsets = points[:, None] - surface.grid.points[nearest]
    heights = np.einsum("ikj,ikj->ik", offsets, surface.normals[nearest])
    beside = np.sqrt(np.maximum(distances[:, 0] ** 2 - heights[:, 0] ** 2, 0)) - surface.spacing
    return np.asarray(np.copysign(np.hypot(heights[:, 0], np.maximum(beside, 0)), heights.sum(axis=1)))
