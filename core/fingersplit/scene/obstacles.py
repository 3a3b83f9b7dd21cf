"""Obstacles as compiled code reads them, and what it finds of them: one record or tuple each."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.limits import MAX_SHAPES, MAX_SPHERES
from fingersplit.objects.grid import PointGrid
from fingersplit.scene.convex_kernel import GJK_ROWS

__all__ = ["HALF_SPACE", "NEAR", "OBSTACLE_WORK", "PRIMITIVE", "SLACKS", "SceneArrays", "new_slacks"]

HALF_SPACE = 0
"""Kind of an endless plane, whose third axis points out of what is occupied; the number of mujoco.mjtGeom."""

NEAR = 2.5e-3
"""[m]; a link with more slack has no obstacle to speak of."""

PRIMITIVE = np.dtype(
    [
        ("kind", np.int64),
        ("obstacle", np.int64),
        ("size", np.float64, 3),
        ("rotation", np.float64, (3, 3)),
        ("position", np.float64, 3),
        ("clearance", np.float64),
        ("pad_clearance", np.float64),
    ],
    align=True,
)
"""A primitive obstacle in the object frame: kind, number of its name, half sizes [m], pose, and the clearance [m] of
links, and of those that carry a pad."""

SLACKS = np.dtype(
    [
        ("slacks", np.float64, MAX_SHAPES),
        ("points", np.float64, (MAX_SHAPES, 3)),
        ("normals", np.float64, (MAX_SHAPES, 3)),
        ("obstacles", np.int64, MAX_SHAPES),
        ("least", np.float64),
    ],
    align=True,
)
"""What ``measure_slacks`` finds for every collision shape: ``slacks`` [m] (infinite when far), the obstacles'
``points`` [m] that they are measured to, unit ``normals`` from the shape towards them, the ``obstacles``' numbers; and
the ``least`` slack of all."""

OBSTACLE_WORK = np.dtype(
    [
        ("centers", np.float64, (MAX_SPHERES, 3)),
        ("rows", np.float64, (GJK_ROWS, 3)),
        ("rotation", np.float64, (3, 3)),
    ],
    align=True,
)
"""Scratch memory: centres of shapes or spheres, and of distances between shapes."""


class SceneArrays(NamedTuple):
    """Obstacles in the object frame.

    Attributes:
        primitives: ``PRIMITIVE`` records (n,), half-spaces first.
        planes: How many of them are half-spaces.
        points: Points of meshes and clouds (n, 3) [m].
        owners: Number of each point's obstacle, (n,) int32.
        inflations: Radius of each point and the clearance of links from it, (n,) [m].
        bounds: Distances [m] that all points are certainly away from each point of a grid, (nx, ny, nz) float32.
        origin: Place of the first of these grid points [m].
        cell: Distance of neighbouring ones [m].
        margin: How far the grid goes beyond all points, at least [m].
        inflation: The largest of ``inflations`` [m].
        hand_reach: Farthest that any point of the hand may be from the palm's origin [m].
        admitted: Whether contacts may be at each of the object's surface samples, (n_samples,).
    """

    primitives: np.recarray
    planes: int
    points: PointGrid
    owners: NDArray[np.int32]
    inflations: NDArray[np.float64]
    bounds: NDArray[np.float32]
    origin: tuple[float, float, float]
    cell: float
    margin: float
    inflation: float
    hand_reach: float
    admitted: NDArray[np.bool_]


def new_slacks() -> tuple[np.record, np.record]:
    """A ``SLACKS`` and an ``OBSTACLE_WORK`` record."""
    return np.rec.array(np.zeros(1, SLACKS))[0], np.rec.array(np.zeros(1, OBSTACLE_WORK))[0]
