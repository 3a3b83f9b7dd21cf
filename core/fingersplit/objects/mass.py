"""Mass, centre of mass and inertia of an object of even density."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions

__all__ = ["ASSUMED_DENSITY", "MAX_ASSUMED_MASS", "MassProperties", "mass_properties"]

ASSUMED_DENSITY = 500.0
"""Where neither density nor mass is known [kg/m^3]."""
MAX_ASSUMED_MASS = 0.5
"""Most that the assumed density may make of an object [kg]."""


class MassProperties(NamedTuple):
    """How an object resists forces.

    Attributes:
        mass: [kg].
        volume: Enclosed volume; of the convex hull where the surface is open [m^3].
        center_of_mass: In the object frame, (3,) [m].
        inertia: About the centre of mass, along the axes of the object frame, (3, 3) [kg m^2].
    """

    mass: float
    volume: float
    center_of_mass: NDArray[np.float64]
    inertia: NDArray[np.float64]


def mass_properties(mesh: Mesh, options: ObjectOptions) -> MassProperties:
    """Mass properties from the options' mass or density, else from an assumed density up to a largest mass."""
    volume = mesh.volume
    if options.mass is not None:
        mass = options.mass
    elif options.density is not None:
        mass = options.density * volume
    else:
        mass = min(ASSUMED_DENSITY * volume, MAX_ASSUMED_MASS)
    spread = mesh.second_moment
    inertia = mass * (np.trace(spread) * np.eye(3) - spread)
    return MassProperties(mass, volume, mesh.center_of_mass, inertia)
