"""Implicit fairing of noisy meshes: one backward step of curvature flow, with the volume restored [Desbrun1999]."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import cg, splu

from fingersplit.objects.mesh import Mesh

__all__ = ["fair"]

_TOLERANCE = 1e-6  # of the positions, relative
_DIRECT = 40_000  # vertices; up to here factors are cheaper than the hundreds of iterations that strong fairing takes
_SLIVER = 1e-3  # least sine of an angle; a cotangent beyond 1000 would hold two vertices together for nothing


def fair(mesh: Mesh, wavelength: float) -> Mesh:
    """Smooth a mesh: a wavelength is attenuated by half, longer ones less, shorter ones more.

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
    smooth[free] = _solved(csr_array(system[free][:, free]), right[free], start[free])
    faired = Mesh(smooth + middle, mesh.faces)
    if not mesh.watertight or faired.volume <= 0:
        return faired
    center = faired.center_of_mass
    growth = (mesh.volume / faired.volume) ** (1 / 3)
    return Mesh(center + growth * (faired.vertices - center), mesh.faces)


def _solved(system: csr_array, right: NDArray[np.float64], start: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solution (n, 3) of a symmetric positive definite system, directly where it is small."""
    if len(start) <= _DIRECT:
        factors = splu(
            system.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        return np.asarray(factors.solve(right))
    scale = diags_array(1.0 / system.diagonal())
    columns = (cg(system, right[:, k], x0=start[:, k], rtol=_TOLERANCE, M=scale, maxiter=500)[0] for k in range(3))
    return np.column_stack(list(columns))


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
