"""Polygons of mesh files, cut into triangles that cover exactly the polygon, from whichever corner it is written."""

from dataclasses import dataclass

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.objects.intake.polygons_kernel import crosses_itself
from fingersplit.objects.intake.refusals import MAX_FACES, check_count

__all__ = ["Polygons", "triangulated"]

_STRICT = 1e-7  # sine of the least turn at a corner of a polygon that is cut without further ado
_AREA_ERROR = 1e-6  # of the squared perimeter, between a polygon and its triangles
_NO_AREA = 1e-12  # of the squared perimeter


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces with any number of corners.

    Attributes:
        corners: Vertex indices, polygon after polygon, int64.
        sizes: Number of corners of each, int64.
        lines: Line of the file that each stands on, counted from 1; None where the file has no lines.
    """

    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    lines: NDArray[np.int64] | None = None

    @classmethod
    def of_triangles(cls, faces: NDArray[np.integer]) -> "Polygons":
        """Polygons of three corners each, (n, 3)."""
        return cls(faces.astype(np.int64).ravel(), np.full(len(faces), 3, np.int64))

    def name(self, number: int) -> str:
        """How a message calls a polygon."""
        place = "" if self.lines is None else f" (line {self.lines[number]})"
        return f"Face {number + 1} of {len(self.sizes):,}{place}"


def triangulated(vertices: NDArray[np.float64], polygons: Polygons) -> NDArray[np.int64]:
    """Triangles (n, 3) that cover the polygons, in their order of corners.

    Convex polygons become fans about their lowest corner (by x, then y, then z), all others go through constrained
    triangulation, so that neither the first corner nor the file's format matters.

    Args:
        vertices: (n, 3), all finite.
        polygons: Their corners are indices of vertices.

    Raises:
        ObjectFileError: A polygon crosses itself, or there would be too many triangles.
    """
    check_count(int(np.maximum(polygons.sizes - 2, 0).sum()), MAX_FACES)
    ends = np.cumsum(polygons.sizes)
    triangles, numbers = list[NDArray[np.int64]](), list[NDArray[np.int64]]()
    for size in np.unique(polygons.sizes[polygons.sizes > 2]).tolist():
        which = np.flatnonzero(polygons.sizes == size)
        corners = polygons.corners[(ends[which] - size)[:, None] + np.arange(size)]
        if size == 3:
            triangles.append(corners)
            numbers.append(which)
            continue
        corners = _from_lowest(vertices, corners)
        convex = _are_convex(vertices[corners])
        triangles.append(_fans(corners[convex]))
        numbers.append(np.repeat(which[convex], size - 2))
        for number, polygon in zip(which[~convex].tolist(), corners[~convex], strict=True):
            triangles.append(_cut(vertices, polygon, polygons.name(number)))
            numbers.append(np.full(len(triangles[-1]), number))
    if not triangles:
        return np.empty((0, 3), np.int64)
    order = np.argsort(np.concatenate(numbers), kind="stable")
    return np.concatenate(triangles)[order]


def _from_lowest(vertices: NDArray[np.float64], corners: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same polygons (n, size), each from its lowest corner on."""
    x, y, z = vertices[corners].transpose(2, 0, 1)
    lowest = np.lexsort((z, y, x), axis=1)[:, 0]
    return np.take_along_axis(corners, (lowest[:, None] + np.arange(corners.shape[1])) % corners.shape[1], axis=1)


def _are_convex(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether polygons (n, size, 3) turn the same way at each corner, and once around in all."""
    sides = np.roll(points, -1, axis=1) - points
    normals = np.cross(points - points[:, :1], sides).sum(axis=1)  # Newell's
    with np.errstate(divide="ignore", invalid="ignore"):
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        before = np.roll(sides, 1, axis=1)
        sines = np.einsum("ijk,ik->ij", np.cross(before, sides), normals)
        cosines = np.einsum("ijk,ijk->ij", before, sides)
        turns = np.arctan2(sines, cosines)
    return np.asarray((turns > _STRICT).all(axis=1) & (np.abs(turns.sum(axis=1) - 2 * np.pi) < 1.0))


def _fans(corners: NDArray[np.int64]) -> NDArray[np.int64]:
    count, size = corners.shape
    first = np.broadcast_to(corners[:, :1], (count, size - 2))
    return np.stack([first, corners[:, 1:-1], corners[:, 2:]], axis=2).reshape(-1, 3)


def _cut(vertices: NDArray[np.float64], polygon: NDArray[np.int64], name: str) -> NDArray[np.int64]:
    """Triangles of a polygon that need not be convex, by ear cutting in its plane."""
    points = vertices[polygon]
    flat, perimeter = _in_plane(points)
    x, y = flat.T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    if perimeter == 0.0 or (abs(area) <= _NO_AREA * perimeter**2 and _on_a_line(flat, perimeter)):
        return _fans(polygon[None])  # without area, which cleaning drops
    crossing = crosses_itself(flat)
    if crossing[0] < 0:
        cut = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32)).reshape(-1, 3).astype(np.int64)
        a, b, c = (flat[corner] for corner in cut.T)
        doubled = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        if abs(np.abs(doubled).sum() / 2 - area) <= _AREA_ERROR * perimeter**2:
            cut = np.where((doubled < 0)[:, None], cut[:, ::-1], cut)
            return np.asarray(polygon[cut])
        crossing = (0, 0)
    raise ObjectFileError(
        "self_crossing",
        f"{name} crosses itself, so it has no inside; split it into triangles where the object was made.",
    )


def _in_plane(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Corners (n, 2) in the plane that fits a polygon, counter-clockwise where it has an area, and its perimeter."""
    offsets = points - points.mean(axis=0)
    sides = np.roll(offsets, -1, axis=0) - offsets
    perimeter = float(np.linalg.norm(sides, axis=1).sum())
    normal = np.cross(offsets, sides).sum(axis=0) / 2
    if np.linalg.norm(normal) <= 1e-9 * perimeter**2:
        normal = np.linalg.svd(offsets)[2][2]
    normal /= np.linalg.norm(normal)
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along /= np.linalg.norm(along)
    return np.ascontiguousarray(offsets @ np.column_stack([along, np.cross(normal, along)])), perimeter


def _on_a_line(flat: NDArray[np.float64], perimeter: float) -> bool:
    return bool(np.linalg.svd(flat - flat.mean(axis=0))[1][1] <= 1e-7 * perimeter)
