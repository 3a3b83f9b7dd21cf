"""Implicit fairing of noisy meshes: one backward step of curvature flow, with the volume restored [Desbrun1999]."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import cg

from fingersplit.objects.mesh import Mesh

__all__ = ["fair"]

_TOLERANCE = 1e-6  # of the positions, relative
_SLIVER = 1e-3  # least sine of an angle; a cotangent beyond 1000 would hold two vertices together for nothing


def fair(mesh: Mesh, wavelength: float) -> Mesh:
    """Smooth a mesh: waves of a wavelength lose half their height, longer ones less, shorter ones more.

    Solves (M + t K) x' = M x with the cotangent stiffness K, the lumped mass M (a third of the area about each
    vertex), and t = (wavelength / 2 pi)^2: the implicit integration of [Desbrun1999] with its curvature operator. The
    volume of a closed mesh is restored by scaling about its centre, as there; the rims of an open one stay in place.

    Args:
        mesh: Open or closed.
        wavelength: Strength of the fairing [m].
    """
    stiffness, mass = _curvature_operator(mesh)
    step = (wavelength / (2 * math.pi)) ** 2
    free = ~_on_rim(mesh)
    system = csr_array(diags_array(mass) + step * stiffness)
    middle = mesh.vertices.mean(axis=0)
    start = mesh.vertices - middle
    smooth = start.copy()
    right = mass[:, None] * start - system @ (start * ~free[:, None])
    inner, scale = system[free][:, free], diags_array(1.0 / system.diagonal()[free])
    for axis in range(3):
        smooth[free, axis], _ = cg(
            inner, right[free, axis], x0=start[free, axis], rtol=_TOLERANCE, M=scale, maxiter=500
        )
    faired = Mesh(smooth + middle, mesh.faces)
    if not mesh.watertight or faired.volume <= 0:
        return faired
    center = faired.center_of_mass
    growth = (mesh.volume / faired.volume) ** (1 / 3)
    return Mesh(center + growth * (faired.vertices - center), mesh.faces)


def _curvature_operator(mesh: Mesh) -> tuple[csr_array, NDArray[np.float64]]:
    """Cotangent stiffness (n, n) and lumped mass (n,) [m^2] of the vertices."""
    n = len(mesh.vertices)
    corners = mesh.vertices[mesh.faces]
    mass, rows, columns, weights = np.zeros(n), [], [], []
    for k in range(3):
        one, other = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        doubled_area = np.linalg.norm(np.cross(one, other), axis=1)
        lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
        half_cotangent = 0.5 * np.einsum("ij,ij->i", one, other) / np.maximum(doubled_area, _SLIVER * lengths)
        mass += np.bincount(mesh.faces[:, k], doubled_area / 6, minlength=n)
        rows += [mesh.faces[:, (k + 1) % 3], mesh.faces[:, (k + 2) % 3]]
        columns += [mesh.faces[:, (k + 2) % 3], mesh.faces[:, (k + 1) % 3]]
        weights += [half_cotangent, half_cotangent]
    places = np.concatenate(rows), np.concatenate(columns)
    links = csr_array(coo_array((np.concatenate(weights), places), shape=(n, n)))
    return csr_array(diags_array(links.sum(axis=1)) - links), np.maximum(mass, mass.mean() * 1e-6)


def _on_rim(mesh: Mesh) -> NDArray[np.bool_]:
    """Vertices on the rim of a hole, (n,)."""
    rim = np.zeros(len(mesh.vertices), dtype=bool)
    if not mesh.watertight:
        edges = mesh.trimesh.edges_sorted
        single = np.bincount(mesh.trimesh.edges_unique_inverse)[mesh.trimesh.edges_unique_inverse] == 1
        rim[edges[single]] = True
    return rim
