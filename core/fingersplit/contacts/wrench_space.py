"""Contacts of a grasp and the wrenches that they can pass, from one grasp matrix.

Torques are taken about the centre of mass and divided by the object's radius, so the six rows of the grasp matrix are
forces and no metric depends on the unit of length.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.cones import cone_edges
from fingersplit.contacts.grasp_matrix import grasp_matrix

__all__ = ["WrenchSpace"]


@dataclass(frozen=True, eq=False)
class WrenchSpace:
    """Contacts and what forces they can pass.

    Attributes:
        contacts: Contact points in the object frame, (F, 3) [m].
        normals: Outward surface normals at the contacts, (F, 3).
        friction: Coulomb friction coefficient.
        center: Torque origin, (3,) [m].
        radius: Length that torques are divided by [m].
    """

    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    friction: float
    center: NDArray[np.float64]
    radius: float

    def grasp_matrix(self) -> NDArray[np.float64]:
        """Map from stacked contact forces in the object frame to the scaled wrench, (6, 3 F)."""
        return grasp_matrix(self.contacts, self.center, self.radius)

    def cone_wrenches(self) -> NDArray[np.float64]:
        """Scaled wrench of every edge of the friction cones, (F * FACETS, 6)."""
        G = self.grasp_matrix().reshape(6, -1, 3)
        return np.asarray(np.einsum("wfk,fek->few", G, cone_edges(self.normals, self.friction)).reshape(-1, 6))

    @cached_property
    def singular_values(self) -> NDArray[np.float64]:
        """Singular values of the grasp matrix, largest first, (6,)."""
        return np.asarray(np.linalg.svd(self.grasp_matrix(), compute_uv=False))
