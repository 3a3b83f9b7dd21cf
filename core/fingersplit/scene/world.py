"""What stands around the object: pose, gravity, support surfaces, obstacles, workspace."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import SceneError
from fingersplit.objects.model import ObjectModel
from fingersplit.scene.entries import Document, Record, entry
from fingersplit.scene.kinds import Flag, Kind, Number, Points, Several, Text, Vector
from fingersplit.scene.shapes import MAX_SIZE, Pose, Primitive

__all__ = ["MAX_OBSTACLES", "MAX_POINTS", "MAX_SUPPORTS", "Obstacle", "Scene", "SupportSurface", "Workspace"]

MAX_OBSTACLES, MAX_SUPPORTS, MAX_POINTS = 1_000, 8, 1_000_000
GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class SupportSurface(Document):
    """A plane that objects stand on; all that lies below it counts as occupied."""

    id: str = entry(Text(), "Name in results.", "table")
    normal: tuple[float, float, float] = entry(
        Vector((3,), "1", normalised=True), "Direction out of the surface, scene frame.", (0.0, 0.0, 1.0)
    )
    offset: float = entry(
        Number("m", -MAX_SIZE, MAX_SIZE), "Distance of the plane from the origin along the normal.", 0.0
    )
    extents: tuple[float, float] | None = entry(
        Vector((2,), "m", 1e-3, MAX_SIZE),
        "Size along the plane, about the point of the plane nearest to the origin; endless when left out. The first is "
        "along the frame's x axis as the plane sees it (y, where the normal is x).",
        None,
    )
    allow_finger_contact: bool = entry(Flag(), "Whether links that carry a pad may touch it.", False)

    @property
    def scene_from_surface(self) -> NDArray[np.float64]:
        """Pose (4, 4) with the origin on the plane, z along the normal and x along the first of the extents."""
        normal = np.array(self.normal)
        axis = np.eye(3)[0] if abs(normal[0]) < 0.9 else np.eye(3)[1]
        x = axis - (axis @ normal) * normal
        x /= np.linalg.norm(x)
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack([x, np.cross(normal, x), normal])
        pose[:3, 3] = self.offset * normal
        return pose


class _Model(Kind):
    """A prepared object, in Python only."""

    def read(self, value: Any) -> ObjectModel:
        if not isinstance(value, ObjectModel):
            raise SceneError("", "must be a prepared object; documents name one by object_id.")
        return value

    def write(self, value: ObjectModel) -> str:
        return value.id

    def schema(self) -> dict[str, Any]:
        return {"not": {}}


@dataclass(frozen=True, eq=False)
class Obstacle(Document):
    """Something that the hand must not touch: a primitive, an object that is known, or points with a radius."""

    id: str = entry(Text(), "Name in results.")
    pose: Pose = entry(Record(Pose), "Where it stands, scene_from_obstacle.", Pose())
    primitive: Primitive | None = entry(Record(Primitive), "Its shape, if it is a primitive.", None)
    object_id: str | None = entry(
        Text(4096), "An uploaded mesh or cloud; on the command line the path of a file, relative to the scene's.", None
    )
    points: NDArray[np.float64] | None = entry(Points(MAX_POINTS), "A cloud, in the obstacle's frame.", None)
    point_radius: float = entry(Number("m", 0.0, 0.1), "Radius of every point of a cloud.", 0.0)
    model: ObjectModel | None = entry(_Model(), "The prepared object, instead of its object_id; in Python only.", None)

    def check(self) -> None:
        """Exactly one description; an object_id may come with the model that it names."""
        given = [name for name in ("primitive", "object_id", "points", "model") if getattr(self, name) is not None]
        if len(given) != 1 and given != ["object_id", "model"]:
            listed = " and ".join(given) or "none of them"
            raise SceneError("primitive", f"give one of primitive, object_id and points, got {listed}.")

    def with_model(self, model: ObjectModel) -> "Obstacle":
        """The same obstacle with the object that its ``object_id`` names."""
        return replace(self, model=model)

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data; an object is named by its id."""
        document = super().to_document()
        model = document.pop("model", None)
        return document if model is None else document | {"object_id": model}


@dataclass(frozen=True)
class Workspace(Document):
    """A box, scene frame, that the palm's origin stays in."""

    min: tuple[float, float, float] = entry(Vector(), "Lowest corner [m].")
    max: tuple[float, float, float] = entry(Vector(), "Highest corner [m].")

    def check(self) -> None:
        """The corners enclose a volume."""
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            if not low < high:
                raise SceneError("max", f"along {axis} it is {high:g}, which is not above min, {low:g}.")


@dataclass(frozen=True)
class Scene(Document):
    """The world around the object."""

    frame: str = entry(Text(), "Name of the frame that all poses of the scene are in.", "world")
    object_pose: Pose | None = entry(
        Record(Pose),
        "world_from_object. When left out: on the first support surface, as a cloud says it stood or else in the "
        "likeliest stable pose; or the identity.",
        None,
    )
    gravity: tuple[float, float, float] = entry(Vector((3,), "m/s^2", -100.0, 100.0), "Gravity, scene frame.", GRAVITY)
    support_surfaces: tuple[SupportSurface, ...] = entry(
        Several(Record(SupportSurface), MAX_SUPPORTS), "What objects stand on.", ()
    )
    obstacles: tuple[Obstacle, ...] = entry(
        Several(Record(Obstacle), MAX_OBSTACLES), "What the hand must not touch.", ()
    )
    clearance: float = entry(Number("m", 0.0, 0.05), "Least distance of the hand from obstacles and supports.", 0.002)
    workspace: Workspace | None = entry(Record(Workspace), "Where the palm may be.", None)

    def check(self) -> None:
        """Every name stands once, and "object" is none."""
        names = [surface.id for surface in self.support_surfaces] + [obstacle.id for obstacle in self.obstacles]
        counted = set[str]()
        for number, name in enumerate(names):
            here = number - len(self.support_surfaces)
            place = f"support_surfaces[{number}].id" if here < 0 else f"obstacles[{here}].id"
            if name in counted:
                raise SceneError(place, f"{name!r} is the name of two things; give each its own.")
            counted.add(name)
        if self.frame == "object":
            raise SceneError("frame", "'object' is the frame of the object itself; give the scene another name.")

    @property
    def world_from_object(self) -> NDArray[np.float64]:
        """The object's pose, (4, 4); the identity when none is given."""
        return np.eye(4) if self.object_pose is None else self.object_pose.matrix

    @property
    def support_in_object(self) -> NDArray[np.float64] | None:
        """Plane of the first support surface that holds the object against gravity, in the object's frame, (4,).

        Unit normal on the object's side and offset along it [m]; None without such a surface, or where the object's
        pose is not given, so that it is only found from its shape.
        """
        if self.object_pose is None:
            return None
        upwards = -np.array(self.gravity)
        for surface in self.support_surfaces:
            normal = np.array(surface.normal)
            if normal @ upwards > 0:
                world_from_object = self.object_pose.matrix
                offset = surface.offset - normal @ world_from_object[:3, 3]
                return np.append(normal @ world_from_object[:3, :3], offset)
        return None
