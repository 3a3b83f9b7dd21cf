"""A checked triangle mesh: the solid outline of an object, in metres."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

__all__ = ["Mesh"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles that enclose an object.

    Attributes:
        vertices: Corner points in the object frame, (n_vertices, 3) [m], read-only.
        faces: Vertex indices, counter-clockwise seen from outside, (n_faces, 3) int32, read-only.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", _read_only(self.vertices, np.float64))
        object.__setattr__(self, "faces", _read_only(self.faces, np.int32))

    @cached_property
    def trimesh(self) -> trimesh.Trimesh:
        """The same triangles for trimesh's geometry (no processing, no merging)."""
        return trimesh.Trimesh(self.vertices, self.faces, process=False, validate=False)

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner, (2, 3) [m]."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @property
    def extents(self) -> NDArray[np.float64]:
        """Edge lengths of the axis-aligned bounding box, (3,) [m]."""
        return np.asarray(self.bounds[1] - self.bounds[0])

    @cached_property
    def area(self) -> float:
        """Surface area [m^2]."""
        return float(self.trimesh.area)

    @cached_property
    def watertight(self) -> bool:
        """Whether each side of a face is met by exactly one other, which runs the other way."""
        # By two plain sorts, since trimesh's search for edges takes five times as long.
        start = self.faces.astype(np.int64)
        end = np.roll(start, -1, axis=1)
        there = np.sort(start * len(self.vertices) + end, axis=None)
        back = np.sort(end * len(self.vertices) + start, axis=None)
        return bool((there == back).all() and (np.diff(there) > 0).all())

    @cached_property
    def volume(self) -> float:
        """Enclosed volume [m^3]; of the convex hull where holes leave the surface open."""
        if not self.watertight:
            return float(self.trimesh.convex_hull.volume)
        # From tetrahedra; trimesh integrates the inertia along with it and takes five times as long.
        return float(np.linalg.det(self._corners_from_middle).sum() / 6)

    @cached_property
    def center_of_mass(self) -> NDArray[np.float64]:
        """Centre of the enclosed volume at even density, (3,) [m]; of the hull where the surface is open."""
        if not self.watertight:
            return np.asarray(self.trimesh.convex_hull.center_mass, dtype=np.float64)
        corners = self._corners_from_middle
        weights = np.linalg.det(corners)  # a tetrahedron's centre is the mean of its corners, the middle being one
        return np.asarray(self.bounds.mean(axis=0) + weights @ corners.sum(axis=1) / (4 * weights.sum()))

    @property
    def _corners_from_middle(self) -> NDArray[np.float64]:
        return np.asarray((self.vertices - self.bounds.mean(axis=0))[self.faces])  # (n_faces, 3 corners, 3)

    @cached_property
    def content_hash(self) -> str:
        """Hash of vertices and faces (32 hex digits): the same triangles have the same name everywhere."""
        digest = hashlib.sha256()
        digest.update(np.array(self.vertices.shape + self.faces.shape, dtype="<i8").tobytes())
        digest.update(self.vertices.astype("<f8").tobytes())
        digest.update(self.faces.astype("<i4").tobytes())
        return digest.hexdigest()[:32]


def _read_only(array: NDArray[Any], dtype: type[np.generic]) -> NDArray[Any]:
    copy = np.array(array, dtype=dtype, order="C")
    copy.setflags(write=False)
    return copy
