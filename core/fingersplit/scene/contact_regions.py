"""Where on the object the fingers may touch and where not, in the object frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.errors import SceneError
from fingersplit.objects.model import ObjectModel
from fingersplit.scene.entries import Document, Record, entry
from fingersplit.scene.kinds import Choice, Indices, Number, Points, Several, Vector
from fingersplit.scene.shapes import MAX_SIZE, Pose

__all__ = ["ContactRegions", "Region"]

MAX_REGIONS = 100
_NEEDED = {
    "box": ("dimensions",),
    "half_space": ("normal", "offset"),
    "sphere": ("radius",),
    "near_cloud": ("points", "distance"),
    "faces": ("faces",),
}
_POSED = ("box", "sphere")


@dataclass(frozen=True, eq=False)
class Region(Document):
    """A part of space or of the surface, object frame."""

    type: str = entry(Choice(tuple(_NEEDED)), "What it is: box, half_space, sphere, near_cloud or faces.")
    pose: Pose | None = entry(Record(Pose), "Where a box or sphere stands, object_from_region.", None)
    dimensions: tuple[float, float, float] | None = entry(
        Vector((3,), "m", 1e-4, MAX_SIZE), "Whole edges of a box.", None
    )
    radius: float | None = entry(Number("m", 1e-4, MAX_SIZE), "Of a sphere.", None)
    normal: tuple[float, float, float] | None = entry(
        Vector((3,), "1", normalised=True), "A half-space is where normal . p <= offset.", None
    )
    offset: float | None = entry(Number("m", -MAX_SIZE, MAX_SIZE), "Of a half-space.", None)
    points: NDArray[np.float64] | None = entry(Points(1_000_000), "Of near_cloud: what counts is near to these.", None)
    distance: float | None = entry(Number("m", 0.0, 1.0), "Of near_cloud: how near.", None)
    faces: NDArray[np.int64] | None = entry(
        Indices(1_000_000), "Of faces: numbers of triangles of the prepared mesh, from 0.", None
    )

    def check(self) -> None:
        """What the type needs, and nothing else."""
        needed = _NEEDED[self.type]
        for name in ("dimensions", "radius", "normal", "offset", "points", "distance", "faces"):
            if name in needed and getattr(self, name) is None:
                raise SceneError(name, f"is missing; a {self.type} region has: {', '.join(needed)}.")
            if name not in needed and getattr(self, name) is not None:
                raise SceneError(name, f"does not belong to a {self.type} region, which has: {', '.join(needed)}.")
        if self.pose is not None and self.type not in _POSED:
            raise SceneError("pose", f"does not belong to a {self.type} region; give its points in the object frame.")

    def contains(self, points: NDArray[np.float64], model: ObjectModel) -> NDArray[np.bool_]:
        """Whether each of ``points`` (n, 3) [m] on the object's surface lies in the region, (n,)."""
        if self.type == "half_space":
            return np.asarray(points @ np.array(self.normal) <= self.offset)
        if self.type == "near_cloud":
            return np.asarray(cKDTree(self.points).query(points)[0] <= self.distance)
        if self.faces is not None:
            return np.isin(_nearest_faces(points, model), self.faces)
        matrix = (self.pose or Pose()).matrix
        local = (points - matrix[:3, 3]) @ matrix[:3, :3]
        if self.type == "sphere":
            return np.asarray(np.linalg.norm(local, axis=1) <= self.radius)
        return np.asarray((np.abs(local) <= 0.5 * np.array(self.dimensions)).all(axis=1))


@dataclass(frozen=True)
class ContactRegions(Document):
    """Where contacts may be: inside one of the allowed regions, when there are any, and in none of the forbidden."""

    allowed: tuple[Region, ...] = entry(Several(Record(Region), MAX_REGIONS), "All is allowed when empty.", ())
    forbidden: tuple[Region, ...] = entry(Several(Record(Region), MAX_REGIONS), "These outweigh the allowed ones.", ())

    @property
    def unbounded(self) -> bool:
        """Whether contacts may be everywhere."""
        return not self.allowed and not self.forbidden

    def admit(self, points: NDArray[np.float64], model: ObjectModel) -> NDArray[np.bool_]:
        """Whether contacts may be at ``points`` (n, 3) [m] on the object's surface, (n,)."""
        inside = _any(self.allowed, points, model) if self.allowed else np.ones(len(points), np.bool_)
        return inside & ~_any(self.forbidden, points, model)


def _any(regions: Sequence[Region], points: NDArray[np.float64], model: ObjectModel) -> NDArray[np.bool_]:
    within = np.zeros(len(points), np.bool_)
    for region in regions:
        within |= region.contains(points, model)
    return within


def _nearest_faces(points: NDArray[np.float64], model: ObjectModel) -> NDArray[np.int64]:
    """Triangle of the mesh nearest to each point (n, 3), (n,)."""
    query = model.mesh.trimesh.nearest.on_surface(np.ascontiguousarray(points))
    return np.asarray(query[2], np.int64)
