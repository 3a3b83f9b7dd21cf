"""Meshes of links as convex pieces for physics engines, kept on disk, since finding them takes seconds."""

import hashlib
from functools import cache
from importlib.metadata import version

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.cache import ContentCache
from fingersplit.compilation import kernel_cache_folder
from fingersplit.errors import CacheError
from fingersplit.extras import extra

__all__ = ["convex_pieces"]

Array = NDArray[np.float64]
Piece = tuple[Array, NDArray[np.int64]]

CONVEX_PIECES, PIECE_VERTICES, VOXELS, VOLUME_ERROR = 8, 64, 30_000, 4.0
"""Most convex pieces of a mesh, most vertices of one, V-HACD's voxels, and the percentage of volume pieces may add."""

NEARLY_CONVEX = 0.85
"""A mesh that fills this share of its hull is taken for its hull."""

CACHE_BYTES = 64 * 2**20


def convex_pieces(vertices: Array, faces: NDArray[np.int64]) -> list[Piece]:
    """Convex pieces of a mesh as corners (n, 3) [m] and outward faces (m, 3); its hull alone where that is nearly it.

    Pieces found once are read from the user's cache folder, below the hash of the mesh and of this module.
    """
    hull = _hull(vertices)
    if hull is None:
        return [(vertices, faces)]
    mesh = trimesh.Trimesh(vertices, faces)
    if mesh.is_watertight and mesh.volume > NEARLY_CONVEX * hull.volume:
        return [_outward(vertices, hull)]
    pieces = _decomposed(vertices, faces)
    hulls = [_hull(piece) for piece in pieces]
    volume = sum(piece.volume for piece in hulls if piece is not None)
    if len(pieces) < 2 or None in hulls or volume > NEARLY_CONVEX * hull.volume:
        return [_outward(vertices, hull)]
    return [_outward(piece, solid) for piece, solid in zip(pieces, hulls, strict=True) if solid]


def _decomposed(vertices: Array, faces: NDArray[np.int64]) -> list[Array]:
    """Corners of the pieces that V-HACD [Mamou2016] finds, now or once before."""
    sources, kept = kernel_cache_folder(__name__).name, _kept()
    digest = hashlib.sha256(np.array(faces.shape).tobytes() + vertices.tobytes() + faces.tobytes()).hexdigest()
    key = f"pieces-{digest}-{version('vhacdx')}-{sources}"
    arrays = kept.fetch(key, lambda: _run(vertices, faces)) if kept else _run(vertices, faces)
    return np.split(np.array(arrays["corners"]), np.cumsum(arrays["counts"])[:-1])


@cache
def _kept() -> ContentCache | None:
    try:
        return ContentCache(kernel_cache_folder(__name__).parent / "hands", CACHE_BYTES)
    except CacheError:
        return None


def _run(vertices: Array, faces: NDArray[np.int64]) -> dict[str, NDArray[np.generic]]:
    with extra("verify"):
        import vhacdx
    found = vhacdx.compute_vhacd(
        vertices,
        np.insert(faces, 0, 3, axis=1).astype(np.uint32).ravel(),
        maxConvexHulls=CONVEX_PIECES,
        maxNumVerticesPerCH=PIECE_VERTICES,
        resolution=VOXELS,
        minimumVolumePercentErrorAllowed=VOLUME_ERROR,
        asyncACD=False,
    )
    corners = [np.asarray(piece, np.float64) for piece, _ in found]
    return {
        "corners": np.concatenate([np.empty((0, 3)), *corners]),
        "counts": np.array([len(piece) for piece in corners]),
    }


def _outward(vertices: Array, hull: ConvexHull) -> Piece:
    """Corners of a hull and its triangles, turned outwards."""
    corners, places = np.unique(hull.simplices, return_inverse=True)
    faces = places.reshape(-1, 3).astype(np.int64)
    points = vertices[corners]
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def _hull(points: Array) -> ConvexHull | None:
    try:
        return ConvexHull(points)
    except (QhullError, ValueError):
        return None
