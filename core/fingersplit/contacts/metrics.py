"""Grasp metrics on finished contacts: isotropy, wrench-space volume and Ferrari-Canny, all from one grasp matrix.

Torques are taken about the centre of mass and divided by the object's radius, so the six rows of the grasp matrix are
forces and no metric depends on the unit of length.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.contacts.cones import cone_edges
from fingersplit.contacts.grasp_matrix import grasp_matrix

__all__ = ["WrenchSpace", "ferrari_canny", "isotropy", "volume"]


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


def isotropy(space: WrenchSpace) -> float:
    """sigma_min(G) / sigma_max(G) in 0..1 [Kim2001]."""
    return float(space.singular_values[-1] / space.singular_values[0])


def volume(space: WrenchSpace) -> float:
    """sqrt(det(G G^T)), the volume of the wrench ellipsoid up to a constant [Li1988]."""
    return float(np.prod(space.singular_values))


def ferrari_canny(space: WrenchSpace) -> float:
    """Largest disturbing wrench that normal forces summing to 1 resist in every direction [Ferrari1992], the L1 form.

    The radius of the largest ball about the origin inside the convex hull of all cone-edge wrenches; 0 without force
    closure. Exact for the inscribed pyramids of ``contacts.cones``.
    """
    wrenches = space.cone_wrenches()
    for options in ("Q0", "Qx"):  # without merging facets three times as fast, where rounding allows it
        try:
            hull = ConvexHull(wrenches, qhull_options=options)
        except QhullError:  # wrenches that span no six-dimensional volume close no grasp
            continue
        return max(0.0, float(-hull.equations[:, -1].max()))
    return 0.0
