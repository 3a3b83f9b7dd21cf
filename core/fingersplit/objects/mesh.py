"""A checked triangle mesh: the solid outline of an object, in metres."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.objects.solid import Solid, solid_of

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

    @property
    def area(self) -> float:
        """Surface area [m^2]."""
        return self.solid.moments.area

    @property
    def watertight(self) -> bool:
        """Whether each side of a face is met by exactly one other, which runs the other way."""
        return self._edges.watertight

    @property
    def balanced(self) -> bool:
        """Whether faces run along each edge as often one way as the other: the surface is closed, maybe pinched."""
        return self._edges.balanced

    @cached_property
    def _edges(self) -> "_Edges":
        # By two plain sorts, since trimesh's search for edges takes five times as long.
        start = self.faces.astype(np.int64)
        end = np.roll(start, -1, axis=1)
        there = np.sort(start * len(self.vertices) + end, axis=None)
        back = np.sort(end * len(self.vertices) + start, axis=None)
        balanced = bool((there == back).all())
        return _Edges(balanced, balanced and bool((np.diff(there) > 0).all()))

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]; see `Solid` for surfaces that are open or overlap."""
        return self.solid.moments.volume

    @property
    def center_of_mass(self) -> NDArray[np.float64]:
        """Centre of the enclosed volume at even density, (3,) [m]."""
        return self.solid.moments.center

    @property
    def second_moment(self) -> NDArray[np.float64]:
        """Mean of x x^T over that volume, x measured from its centre, (3, 3) [m^2]."""
        return self.solid.moments.second_moment

    @cached_property
    def solid(self) -> Solid:
        """What the triangles enclose."""
        return solid_of(self.vertices, self.faces, self.balanced)

    @cached_property
    def content_hash(self) -> str:
        """Hash of vertices and faces (32 hex digits): the same triangles have the same name everywhere."""
        digest = hashlib.sha256()
        digest.update(np.array(self.vertices.shape + self.faces.shape, dtype="<i8").tobytes())
        digest.update(self.vertices.astype("<f8").tobytes())
        digest.update(self.faces.astype("<i4").tobytes())
        return digest.hexdigest()[:32]


class _Edges(NamedTuple):
    balanced: bool
    watertight: bool


def _read_only(array: NDArray[Any], dtype: type[np.generic]) -> NDArray[Any]:
    if array.dtype == dtype and array.flags.c_contiguous and not array.flags.writeable:
        return array  # such as one that is mapped from a file
    copy = np.array(array, dtype=dtype, order="C")
    copy.setflags(write=False)
    return copy
