"""Parts inside other parts, and holes: what a surface has beside its outer shell."""

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.graph import connected_component_labels

from fingersplit.objects.intake.cleaning import VIEW, signed_volumes
from fingersplit.objects.mesh import Mesh

__all__ = ["drop_inner_parts", "find_holes"]

_MAX_SHELLS = 64  # the largest closed parts; what lies inside a smaller one than these is too small to matter
_PROBES = 64  # vertices of a part that must all lie inside


def drop_inner_parts(mesh: Mesh) -> tuple[Mesh, int]:
    """Drop the parts that lie wholly inside a closed one, such as the walls of cavities: no finger can reach them.

    Args:
        mesh: Its faces turned outwards.

    Returns:
        The mesh, and how many parts were dropped.
    """
    part = connected_component_labels(np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]]), len(mesh.vertices))
    part = np.unique(part, return_inverse=True)[1]
    n_parts = int(part.max()) + 1
    if n_parts == 1:
        return mesh, 0
    part_of_face = part[mesh.faces[:, 0]]
    volumes = signed_volumes(mesh.vertices, mesh.faces, part_of_face)
    shells = np.argsort(-volumes, kind="stable")[:_MAX_SHELLS]
    shells = shells[(volumes[shells] > 0) & _closed_parts(mesh, part_of_face)[shells]]
    low, high = (np.full((n_parts, 3), sign * np.inf) for sign in (1, -1))
    np.minimum.at(low, part, mesh.vertices)
    np.maximum.at(high, part, mesh.vertices)
    in_box = np.concatenate([low[:, None] > low[shells], high[:, None] < high[shells]], axis=2)
    boxed = np.asarray(in_box.all(axis=2))  # (n_parts, n_shells)
    inner = np.flatnonzero(np.count_nonzero(boxed, axis=1))
    if not len(inner):
        return mesh, 0
    probes = np.concatenate([_probes(np.flatnonzero(part == number), mesh.vertices) for number in inner])
    enclosed = _enclosures(mesh, part_of_face, shells, mesh.vertices[probes]) & boxed[part[probes]]
    outside = np.zeros((n_parts, len(shells)), dtype=bool)
    np.logical_or.at(outside, part[probes], ~enclosed)
    dropped = np.zeros(n_parts, dtype=bool)
    dropped[inner] = ~outside[inner].all(axis=1)
    kept = trimesh.Trimesh(mesh.vertices, mesh.faces[~dropped[part_of_face]], process=False)
    kept.remove_unreferenced_vertices()
    return Mesh(kept.vertices, kept.faces), int(np.count_nonzero(dropped))


def find_holes(mesh: Mesh) -> NDArray[np.float64]:
    """Length of the rim of every hole [m], the longest first; holes that touch in a vertex count as one."""
    if mesh.watertight:
        return np.empty(0)
    surface = mesh.trimesh
    single = np.bincount(surface.edges_unique_inverse)[surface.edges_unique_inverse] == 1
    rims = surface.edges_sorted[single]
    if not len(rims):
        return np.empty(0)
    lengths = np.linalg.norm(mesh.vertices[rims[:, 0]] - mesh.vertices[rims[:, 1]], axis=1)
    hole = connected_component_labels(rims, len(mesh.vertices))[rims[:, 0]]
    perimeters = np.bincount(np.unique(hole, return_inverse=True)[1], lengths)
    return np.asarray(-np.sort(-perimeters), dtype=np.float64)


def _closed_parts(mesh: Mesh, part_of_face: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether each part has no rim, (n_parts,)."""
    closed = np.ones(int(part_of_face.max()) + 1, dtype=bool)
    if not mesh.watertight:
        surface = mesh.trimesh
        single = np.bincount(surface.edges_unique_inverse)[surface.edges_unique_inverse] == 1
        closed[part_of_face[surface.edges_face[single]]] = False
    return closed


def _probes(members: NDArray[np.integer], vertices: NDArray[np.float64]) -> NDArray[np.integer]:
    """Vertices that stand for a part: the outermost along the axes, and some of the others."""
    outermost = [*vertices[members].argmin(axis=0), *vertices[members].argmax(axis=0)]
    return np.asarray(members[np.unique([*outermost, *np.linspace(0, len(members) - 1, _PROBES).astype(np.int64)])])


def _enclosures(
    mesh: Mesh, part_of_face: NDArray[np.integer], shells: NDArray[np.integer], points: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether a ray from each point (n, 3) leaves each shell once more than it enters it, (n, n_shells)."""
    place = np.full(int(part_of_face.max()) + 1, -1)
    place[shells] = np.arange(len(shells))
    faces = np.flatnonzero(place[part_of_face] >= 0)
    shell_surface = trimesh.Trimesh(mesh.vertices, mesh.faces[faces], process=False)
    directions = np.broadcast_to(VIEW / np.linalg.norm(VIEW), points.shape)
    hits, rays = shell_surface.ray.intersects_id(points, directions, multiple_hits=True)
    leaves = np.sign(shell_surface.face_normals[hits] @ VIEW)
    total = np.zeros((len(points), len(shells)))
    np.add.at(total, (rays, place[part_of_face[faces[hits]]]), leaves)
    return total > 0
