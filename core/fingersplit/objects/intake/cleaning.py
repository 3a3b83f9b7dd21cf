"""A clean, outward surface out of a file's triangles, by trimesh's operations wherever they keep what must be kept."""

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from trimesh import grouping
from trimesh.graph import connected_component_labels
from trimesh.ray.ray_util import contains_points

from fingersplit.objects.intake.parts_kernel import parts_by_edges
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.triangle_grid import bin_triangles
from fingersplit.objects.triangle_grid_kernel import cast

__all__ = [
    "VIEW",
    "close_cracks",
    "drop_needless_faces",
    "faces_at_edges",
    "merge_vertices",
    "signed_volumes",
    "turn_outwards",
]

_CELLS = 2**21 - 8  # along the largest extent: about what float32 resolves, and what trimesh packs into one integer
_NO_AREA = 1e-14  # of the squared extent
_CRACK, _OF_SIDE = 1e-3, 0.25  # width of a crack, of the extent and of the sides along it
_MAX_TURNS = 1_000  # of patches between edges of more than two faces
_MAX_PATCHES, _FACES_ASKED = 2_000, 5  # patches that are asked which side of them the object is on, at how many faces
_MAX_CROSSINGS = 256  # of a ray
VIEW = np.array([0.43, 0.62, 0.65])
"""Direction of rays that tell inside from outside; trimesh draws one at random where its own leaves doubt."""


def merge_vertices(surface: trimesh.Trimesh, extent: float) -> int:
    """Merge vertices at the same place, to a fraction of the extent [m] where trimesh's own merging has 1e-8 m.

    Returns:
        How many vertices were joined with another.
    """
    middle = (surface.vertices.min(axis=0) + surface.vertices.max(axis=0)) / 2
    cells = np.rint((surface.vertices - middle) * ((_CELLS - 1) / extent)).astype(np.int64)
    first, inverse = grouping.unique_rows(cells, keep_order=True)
    surface.update_vertices(first, inverse)
    return len(cells) - len(first)


def drop_needless_faces(surface: trimesh.Trimesh, extent: float) -> tuple[int, int]:
    """Drop faces that add nothing to the surface.

    Two equal corners are no face; of several faces with the same corners the first stays. A face whose
    corners lie on one line, or that the file has in both directions, bounds no volume: it stays only where at
    least two of its sides join it to a neighbour, since without it the surface would have a hole there; trimesh's
    own cleaning tears such holes.

    Returns:
        How many faces without area were dropped, and how many that repeat another.
    """
    n_faces = len(surface.faces)
    surface.update_faces((surface.faces != np.roll(surface.faces, 1, axis=1)).all(axis=1))
    n_shaped = len(surface.faces)
    first, group = grouping.unique_rows(np.sort(surface.faces, axis=1), keep_order=True)
    a, b, c = surface.faces.T
    n_odd = np.bincount(group, (a < b) ^ (b < c) ^ (c < a))  # parity of the corners' order: which way it faces
    both_ways = (n_odd > 0) & (n_odd < np.bincount(group))
    surface.update_faces(first)
    on_line = surface.area_faces <= _NO_AREA * extent**2
    needless = on_line | both_ways
    if needless.any():
        sides = np.bincount(surface.edges_unique_inverse)[surface.edges_unique_inverse].reshape(-1, 3)
        needless &= np.count_nonzero(sides == 2, axis=1) < 2
    n_on_line = int(np.count_nonzero(needless & on_line))
    surface.update_faces(~needless)
    surface.remove_unreferenced_vertices()
    return n_faces - n_shaped + n_on_line, n_shaped - len(surface.faces) - n_on_line


def close_cracks(surface: trimesh.Trimesh, extent: float) -> int:
    """Join vertices on the two sides of a crack: rims that run beside each other, nearer than anything else is.

    Two vertices on rims are joined when each is the other's nearest, to a thousandth of the extent [m] and to a quarter
    of the sides next to them, unless no rim becomes shorter by it.

    Returns:
        How many vertices were joined with another.
    """
    rims = _rims(surface)
    if not len(rims):
        return 0
    vertices = surface.vertices
    on_rim, ends = np.unique(rims, return_inverse=True)
    shortest = np.full(len(on_rim), np.inf)
    np.minimum.at(
        shortest, ends.reshape(-1, 2), np.linalg.norm(vertices[rims[:, 0]] - vertices[rims[:, 1]], axis=1)[:, None]
    )
    near = _CRACK * extent
    distances, nearest = cKDTree(vertices[on_rim]).query(vertices[on_rim], 2, distance_upper_bound=near)
    other = nearest[:, 1]
    pairs = np.flatnonzero(distances[:, 1] < _OF_SIDE * shortest)
    pairs = pairs[(other[other[pairs]] == pairs) & (pairs < other[pairs])]
    renamed = np.arange(len(vertices))
    renamed[on_rim[other[pairs]]] = on_rim[pairs]
    faces = renamed[surface.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if len(_rims(trimesh.Trimesh(vertices, faces, process=False))) >= len(rims):
        return 0
    surface.faces = faces
    surface.remove_unreferenced_vertices()
    return len(pairs)


def _rims(surface: trimesh.Trimesh) -> NDArray[np.integer]:
    """Edges (n, 2) that have one face."""
    single = np.bincount(surface.edges_unique_inverse)[surface.edges_unique_inverse] == 1
    return np.asarray(surface.edges_sorted[single])


def faces_at_edges(mesh: Mesh) -> NDArray[np.int64]:
    """How many faces meet at each edge, (n_edges,)."""
    if mesh.watertight:  # known without trimesh's search for edges, which takes half a second for 400,000 faces
        return np.full(3 * len(mesh.faces) // 2, 2)
    return np.bincount(mesh.trimesh.edges_unique_inverse)


def turn_outwards(mesh: Mesh) -> tuple[Mesh, int, int]:
    """Turn faces so that their normals point out of the object.

    trimesh's own repair turns faces one by one in Python, leaves open parts as they are, and turns the walls of
    cavities outwards.

    Returns:
        The mesh, the number of faces that were turned over, and the number of parts that share no vertex.
    """
    faces, wrong = mesh.faces, np.zeros(len(mesh.faces), dtype=bool)
    if mesh.watertight:
        group = parts_by_edges(faces, len(mesh.vertices))  # a vertex in common does not make two parts face one way
    else:
        wrong = _wound_against(mesh.trimesh)
        against, group = _patches_against(mesh.trimesh, np.where(wrong[:, None], faces[:, ::-1], faces))
        wrong ^= against
        faces = np.where(wrong[:, None], faces[:, ::-1], faces)
    inward = _inward(mesh.vertices, faces, group)
    flipped = int(np.count_nonzero(wrong ^ inward))
    if flipped:
        mesh = Mesh(mesh.vertices, np.where(inward[:, None], faces[:, ::-1], faces))
    if mesh.watertight and not group.any():
        return mesh, flipped, 1
    label = connected_component_labels(np.concatenate([faces[:, :2], faces[:, 1:]]), len(mesh.vertices))
    return mesh, flipped, int(label.max()) + 1


def _wound_against(surface: trimesh.Trimesh) -> NDArray[np.bool_]:
    """Find faces to flip, (m,), so that neighbours across every two-faced edge agree.

    Each face stands for two nodes of a graph, as it is and flipped, and an edge joins the nodes that agree.
    All that hangs together with the first face of a part, as it is, makes one consistent choice for it.
    A one-sided surface joins both nodes of a face and is left alone.
    """
    n_faces = len(surface.faces)
    pairs = grouping.group_rows(surface.edges_sorted, require_count=2)
    one, other = surface.edges_face[pairs].T
    crossed = surface.edges[pairs[:, 0], 0] == surface.edges[pairs[:, 1], 0]
    as_is = np.stack([one, other + n_faces * crossed], axis=1)
    flipped = np.stack([one + n_faces, other + n_faces * ~crossed], axis=1)
    as_is, flipped = connected_component_labels(np.concatenate([as_is, flipped]), 2 * n_faces).reshape(2, -1)
    # Both choices of a part carry a label each; take the one that has its first face as it is.
    part, first_face = np.unique(np.minimum(as_is, flipped), return_index=True)
    chosen = as_is[first_face][np.searchsorted(part, np.minimum(as_is, flipped))]
    return np.asarray((as_is != chosen) & (as_is != flipped))


def _patches_against(
    surface: trimesh.Trimesh, faces: NDArray[np.integer]
) -> tuple[NDArray[np.bool_], NDArray[np.integer]]:
    """Find patches to flip where more than two faces meet at edges.

    A patch hangs together by edges of two faces. Those with the object on the wrong side are flipped; of those that
    have it on both sides or on none, one by one, those that then leave fewer edges out of balance, where faces run
    along an edge more often one way than the other.

    Args:
        surface: The surface, for its edges.
        faces: Its faces (m, 3), patches wound consistently.

    Returns:
        The faces to flip, (m,) bool, and which faces must be turned together, (m,).
    """
    pairs = grouping.group_rows(surface.edges_sorted, require_count=2)
    patch = connected_component_labels(surface.edges_face[pairs], len(faces))
    group, none = np.asarray(patch), np.zeros(len(faces), dtype=bool)
    edge = surface.edges_unique_inverse
    uses = np.flatnonzero(np.bincount(edge)[edge] > 2)
    if not len(uses):
        return none, group
    start, end = faces.ravel()[uses], np.roll(faces, -1, axis=1).ravel()[uses]
    shape = int(edge.max()) + 1, int(patch.max()) + 1
    runs = coo_array((np.where(start < end, 1, -1), (edge[uses], patch[uses // 3])), shape=shape).tocsc()
    runs.eliminate_zeros()
    signs = _facing(surface, faces, patch)
    fixed = signs != 0
    signs[~fixed] = 1.0
    weight, surplus = np.asarray(runs.multiply(runs).sum(axis=0)).ravel(), runs @ signs
    for _ in range(_MAX_TURNS):
        gain = np.where(fixed, 0.0, signs * (runs.T @ surplus) - weight)
        best = int(np.argmax(gain))
        if gain[best] <= 0:
            break
        surplus -= 2 * signs[best] * runs[:, [best]].toarray().ravel()
        signs[best] = -signs[best]
    _, joined = connected_components((abs(runs).T @ abs(runs)).tocsr(), directed=False)
    return np.asarray(signs[patch] < 0), np.asarray(joined[patch])


def _facing(surface: trimesh.Trimesh, faces: NDArray[np.integer], patch: NDArray[np.integer]) -> NDArray[np.float64]:
    """1 for patches that have the object behind them, -1 in front, 0 where neither or both, (n_patches,).

    A point is in the object when a ray from it crosses the surface an odd number of times, however that is wound.
    """
    signs = np.zeros(int(patch.max()) + 1)
    if len(signs) > _MAX_PATCHES:
        return signs
    order = np.lexsort((-surface.area_faces, patch))
    first = np.searchsorted(patch[order], np.arange(len(signs)))
    shown = np.unique(order[np.minimum(first[:, None] + np.arange(_FACES_ASKED), len(order) - 1)])
    a, b, c = (surface.vertices[corner] for corner in faces[shown].T)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    # Not the middle: the diagonal of a doubled face may run through it.
    middle, step = 0.43 * a + 0.34 * b + 0.23 * c, 1e-4 * surface.scale
    points = np.concatenate([middle + step * normals, middle - step * normals])
    grid, longest = bin_triangles(Mesh(surface.vertices, faces.astype(np.int32))), 4.0 * float(surface.scale)
    direction = tuple((VIEW / np.linalg.norm(VIEW)).tolist())
    distances, crossed = np.empty(_MAX_CROSSINGS), np.empty(_MAX_CROSSINGS, np.int64)
    counts = [cast(grid, tuple(point), direction, longest, distances, crossed) for point in points.tolist()]
    in_front, behind = (np.array(counts) % 2 == 1).reshape(2, -1)
    votes = np.bincount(patch[shown], behind.astype(float) - in_front, minlength=len(signs))
    return np.asarray(np.sign(votes))


def _inward(vertices: NDArray[np.float64], faces: NDArray[np.integer], part: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Mask the faces of parts that are inside out, (m,).

    A part inside the largest one and wound against it is the wall of a cavity: it goes with the largest part.
    """
    volumes = signed_volumes(vertices, faces, part)
    inward = volumes < 0
    largest = int(np.argmax(np.abs(volumes)))
    against = np.flatnonzero(inward != inward[largest])
    if len(against):
        shell = trimesh.Trimesh(vertices, faces[part == largest], process=False)
        first_faces = np.unique(part, return_index=True)[1][against]
        # Not a corner: it may lie on the largest part, too.
        middles = vertices[faces[first_faces]].mean(axis=1)
        cavities = contains_points(shell.ray, middles, check_direction=VIEW)
        inward[against[cavities]] = inward[largest]
    return np.asarray(inward[part])


def signed_volumes(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], part: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Volume of each part [m^3], negative if inside out; of the cone from its rim to its middle if open."""
    a, b, c = (vertices.take(corner, axis=0) for corner in faces.T)
    counts = np.bincount(part)
    middles = np.stack([np.bincount(part, axis) / counts for axis in a.T], axis=1)
    return np.bincount(part, np.einsum("ij,ij->i", a - middles[part], np.cross(b - a, c - a))) / 6
