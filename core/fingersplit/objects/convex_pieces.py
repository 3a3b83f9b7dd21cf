"""An object as convex pieces, which is what a physics engine can collide fast.

V-HACD [Mamou2016] (``vhacdx``) does the work. CoACD, tried on the same objects with 16 pieces, came out equally close
to the surface (mean error 0.3 to 1.8 mm against 0.4 to 1.7 mm) and took three to ten times as long.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import trimesh
import vhacdx
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fingersplit.objects.mesh import Mesh

__all__ = ["ConvexPieces", "close_holes", "decompose"]

PIECES = 64
HULL_VERTICES = 64
VOXELS = 100_000
RECURSION = 7

Piece = tuple[NDArray[np.float64], NDArray[np.int32]]


@dataclass(frozen=True, eq=False)
class ConvexPieces:
    """Convex bodies that together stand for an object.

    Attributes:
        pieces: Vertices (n, 3) [m], object frame, and outward faces (m, 3) int32 of each piece.
        method: ``"vhacdx"``, or ``"convex_hull"`` where the object is its own hull.
    """

    pieces: tuple[Piece, ...]
    method: str

    def to_arrays(self) -> dict[str, NDArray[np.generic]]:
        """The same as flat arrays, for a cache."""
        return {
            "vertices": np.concatenate([vertices for vertices, _ in self.pieces]),
            "faces": np.concatenate([faces for _, faces in self.pieces]),
            "counts": np.array([(len(vertices), len(faces)) for vertices, faces in self.pieces], np.int64),
            "method": np.array(self.method),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[np.generic]]) -> Self:
        """Pieces from what ``to_arrays`` made."""
        ends = np.cumsum(arrays["counts"], axis=0)[:-1]
        vertices = np.split(np.asarray(arrays["vertices"], np.float64), ends[:, 0])
        faces = np.split(np.asarray(arrays["faces"], np.int32), ends[:, 1])
        return cls(tuple(zip(vertices, faces, strict=True)), str(arrays["method"]))

    @cached_property
    def _planes(self) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        return [(t.face_normals, t.triangles[:, 0]) for t in (trimesh.Trimesh(*p, process=False) for p in self.pieces)]

    def distance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance of points (n, 3) to the pieces (n,) [m]: exact inside (negative), never too large outside."""
        distances = [
            ((points[:, None] - corners) * normals).sum(axis=2).max(axis=1) for normals, corners in self._planes
        ]
        return np.asarray(np.min(distances, axis=0))


def decompose(mesh: Mesh, pieces: int = PIECES, voxels: int = VOXELS) -> ConvexPieces:
    """Split a mesh into at most ``pieces`` convex bodies of at most ``HULL_VERTICES`` vertices.

    Holes are closed first. The same mesh always gives the same pieces. More pieces lie closer to the surface: 64 of
    them 0.2 to 0.7 mm in the mean, 16 twice as far; the time of a simulation step hardly depends on it.

    Args:
        mesh: The object.
        pieces: Most pieces.
        voxels: Size of the grid on which V-HACD measures concavity.
    """
    vertices, faces = close_holes(mesh)
    hull = trimesh.convex.convex_hull(vertices)
    if len(hull.vertices) <= HULL_VERTICES and hull.volume - mesh.volume <= 1e-3 * hull.volume:
        return ConvexPieces((_piece(hull.vertices, hull.faces),), "convex_hull")
    found = vhacdx.compute_vhacd(
        vertices,
        np.insert(faces, 0, 3, axis=1).astype(np.uint32).ravel(),
        maxConvexHulls=pieces,
        maxNumVerticesPerCH=HULL_VERTICES,
        resolution=voxels,
        maxRecursionDepth=RECURSION,
        asyncACD=False,
    )
    return ConvexPieces(tuple(_piece(*piece) for piece in found), "vhacdx")


def close_holes(mesh: Mesh) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) [m] and faces (m, 3) of a mesh whose every hole is closed by a fan about its middle."""
    faces = mesh.faces.astype(np.int64)
    if mesh.watertight:
        return mesh.vertices, faces
    count = len(mesh.vertices)
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there, back = edges @ (count, 1), edges @ (1, count)
    rim = edges[~np.isin(there, back)]  # directed as their faces have them
    adjacency = coo_array((np.ones(len(rim)), rim.T), shape=(count, count))
    _, hole_of_vertex = connected_components(adjacency, directed=False)
    holes, hole_of_edge = np.unique(hole_of_vertex[rim[:, 0]], return_inverse=True)
    middles = np.array([mesh.vertices[rim[hole_of_edge == hole, 0]].mean(axis=0) for hole in range(len(holes))])
    fans = np.column_stack([rim[:, ::-1], count + hole_of_edge])
    return np.vstack([mesh.vertices, middles]), np.vstack([faces, fans])


def _piece(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Piece:
    corners, triangles = np.array(vertices, np.float64), np.array(faces, np.int32)
    corners.setflags(write=False)
    triangles.setflags(write=False)
    return corners, triangles
