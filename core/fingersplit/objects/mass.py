"""Mass, centre of mass and inertia of an object of even density."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions

__all__ = ["ASSUMED_DENSITY", "MAX_ASSUMED_MASS", "MassProperties", "mass_properties"]

ASSUMED_DENSITY = 500.0
"""Of a solid object, where neither density nor mass is known [kg/m^3]: between a toy and a full package."""
MAX_ASSUMED_MASS = 0.5
"""Most that an assumption may make of an object [kg]."""
WALL_DENSITY = 1_200.0
"""Of the walls of a thin shell [kg/m^3]: plastics have 900 to 1,400, ceramics 2,400."""
MIN_WALL = 2e-3
"""Wall thickness that a shell is assumed to have at least [m]; files often show less, or a single surface."""
MAX_WALL = 6e-3
"""Up to this mean thickness, twice the volume over the area, an object that fills little of its hull is a shell [m]."""
SHELL_SHARE = 0.35
"""Share of its hull's volume that a shell fills at most."""
OPEN_SHELL = 0.1
"""Share of its area that a surface lacks beyond which it is taken for a wall itself, such as a cup's."""
_HULL_POINTS = 4_000


class MassProperties(NamedTuple):
    """How an object resists forces.

    Attributes:
        mass: [kg].
        volume: Enclosed volume; see `Solid` for surfaces that are open or overlap [m^3].
        center_of_mass: In the object frame, (3,) [m].
        inertia: About the centre of mass, along the axes of the object frame, (3, 3) [kg m^2].
        basis: Where the mass is from: ``"given"``, ``"given_density"``, ``"assumed_density"``, or
            ``"assumed_wall"`` for a thin shell.
    """

    mass: float
    volume: float
    center_of_mass: NDArray[np.float64]
    inertia: NDArray[np.float64]
    basis: str


def mass_properties(mesh: Mesh, options: ObjectOptions) -> MassProperties:
    """Mass properties from the options' mass or density, else from an assumption.

    A solid is assumed to have ``ASSUMED_DENSITY``, a thin shell walls of at least ``MIN_WALL`` and ``WALL_DENSITY``;
    either weighs ``MAX_ASSUMED_MASS`` at most.
    """
    if options.mass is not None:
        mass, basis = options.mass, "given"
    elif options.density is not None:
        mass, basis = options.density * mesh.volume, "given_density"
    else:
        mass, basis = _assumed(mesh)
    spread = mesh.second_moment
    inertia = mass * (np.trace(spread) * np.eye(3) - spread)
    return MassProperties(mass, mesh.volume, mesh.center_of_mass, inertia, basis)


def _assumed(mesh: Mesh) -> tuple[float, str]:
    """Assumed mass [kg] and what it is from."""
    if mesh.solid.open_share > OPEN_SHELL:
        return min(WALL_DENSITY * MIN_WALL * mesh.area, MAX_ASSUMED_MASS), "assumed_wall"
    wall = 2 * mesh.volume / mesh.area
    if wall <= MAX_WALL and mesh.volume < SHELL_SHARE * _hull_volume(mesh):
        mass = WALL_DENSITY * max(wall, MIN_WALL) * mesh.area / 2
        return min(mass, MAX_ASSUMED_MASS), "assumed_wall"
    return min(ASSUMED_DENSITY * mesh.volume, MAX_ASSUMED_MASS), "assumed_density"


def _hull_volume(mesh: Mesh) -> float:
    """Volume of the convex hull [m^3], nearly, by some of the vertices; 0 where they lie in a plane."""
    try:
        return float(ConvexHull(mesh.vertices[:: -(-len(mesh.vertices) // _HULL_POINTS)]).volume)
    except QhullError:
        return 0.0
