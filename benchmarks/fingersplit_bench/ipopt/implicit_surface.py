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
"""Of the grid, about; the pitch follows."""
MARGIN = 8
"""Grid nodes beyond the object's bounds on every side: room for the search, and for the spline's border."""
FLAT = 2.0
"""Nearer to a sample than this many sample spacings, distance is measured from the sample's tangent plane."""


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


def fit_surface(model: ObjectModel) -> ImplicitSurface:
    """Fit the surface of an object; details finer than ``pitch`` are rounded off."""
    began = perf_counter()
    bounds = model.mesh.bounds
    pitch = float((np.prod(model.mesh.extents) / NODES) ** (1 / 3))
    shape = np.ceil(model.mesh.extents / pitch).astype(int) + 1 + 2 * MARGIN
    origin = bounds.mean(axis=0) - pitch * (shape - 1) / 2
    nodes = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    values = signed_distance(model, origin + pitch * nodes).reshape(shape)
    coefficients = spline_filter(values, order=3)
    # Coefficient i belongs to the basis function about node i, which reaches two nodes to either side.
    knots = [(origin[axis] + pitch * (np.arange(shape[axis] + 4) - 2)).tolist() for axis in range(3)]
    distance = casadi.Function.bspline("distance", knots, coefficients.ravel(order="F").tolist(), [3, 3, 3], 1)
    border = 2 * pitch
    return ImplicitSurface(
        distance, origin + border, origin + pitch * (shape - 1) - border, pitch, perf_counter() - began
    )


def signed_distance(model: ObjectModel, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of points (n, 3) [m] from the object's surface samples, negative inside, (n,) [m]."""
    surface = model.surface
    distances, nearest = KDTree(surface.grid.points).query(points)
    offsets = points - surface.grid.points[nearest]
    heights = np.einsum("ij,ij->i", offsets, surface.normals[nearest])
    return np.asarray(np.where(distances < FLAT * surface.spacing, heights, np.copysign(distances, heights)))
