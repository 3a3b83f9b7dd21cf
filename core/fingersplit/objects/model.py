"""The object as the planner needs it: mesh, surface samples, collision points and mass."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.grid import PointGrid, build_grid, thin_evenly
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.signed_distance import DistanceGrid, build_distance_grid
from fingersplit.objects.surface import PACKING, Surface, sample_surface

__all__ = ["ObjectModel", "prepare_object"]

COLLISION_POINTS = 2_000
DENSITY = 500.0
"""Assumed where no mass is known [kg/m^3]."""
LARGEST_MASS = 0.5
"""Most that the assumed density may make of an object [kg]."""


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """A prepared object.

    Attributes:
        mesh: The checked triangles.
        name: What people call it.
        surface: Evenly spaced samples with outward normals.
        collision: The sparser points that stand for the surface in collision tests, the part that supervoxel centres
            play in [Fan2018] section III-A3.
        distance: Signed distance on a grid, which culls collision tests and pushes links away.
    """

    mesh: Mesh
    name: str
    surface: Surface
    collision: PointGrid
    distance: DistanceGrid

    @property
    def center_of_mass(self) -> NDArray[np.float64]:
        """Centre of mass at even density, (3,) [m]."""
        return self.mesh.center_of_mass

    @property
    def mass(self) -> float:
        """Mass at the assumed density, capped [kg]."""
        return min(DENSITY * self.mesh.volume, LARGEST_MASS)

    @cached_property
    def radius(self) -> float:
        """Largest distance of the surface from the centre of mass [m]: the scale that makes torques forces."""
        return float(np.linalg.norm(self.surface.grid.points - self.center_of_mass, axis=1).max())

    def to_document(self) -> dict[str, Any]:
        """The ``object`` part of a result document, SI units."""
        return {
            "id": self.mesh.content_hash,
            "name": self.name,
            "extents": self.mesh.extents.tolist(),
            "volume": self.mesh.volume,
            "mass": self.mass,
            "center_of_mass": self.center_of_mass.tolist(),
            "samples": len(self.surface.normals),
            "sample_spacing": self.surface.spacing,
        }


def prepare_object(mesh: Mesh, name: str = "object") -> ObjectModel:
    """Sample a mesh for planning; the same mesh always gives the same model."""
    surface = sample_surface(mesh)
    samples = surface.grid.points
    spacing = math.sqrt(PACKING * mesh.area / COLLISION_POINTS)
    points = samples[thin_evenly(samples, spacing)]
    collision, _ = build_grid(points, 2.0 * spacing)
    return ObjectModel(mesh, name, surface, collision, build_distance_grid(surface.grid, surface.normals))
