"""Parts of a scene as plain data, for ``scene``, ``approach`` and the other entries of a job.

The service checks them and names the entry that is wrong; see ``docs/scenes.md`` for all entries. Lengths are in
metres, quaternions are ``wxyz``.
"""

import math
from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

__all__ = [
    "Part",
    "approach",
    "box",
    "capsule",
    "cloud",
    "cone",
    "cylinder",
    "mesh",
    "pose",
    "scene",
    "sphere",
    "table",
]

Part: TypeAlias = dict[str, Any]
"""A part of a scene, plain JSON data."""

Vector: TypeAlias = Sequence[float]

_DIRECTIONS = {
    "down": (0.0, 0.0, -1.0),
    "up": (0.0, 0.0, 1.0),
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}


def pose(position: Vector = (0.0, 0.0, 0.0), wxyz: Vector = (1.0, 0.0, 0.0, 0.0)) -> Part:
    """A pose: position [m] and quaternion."""
    return {"position": _numbers(position), "wxyz": _numbers(wxyz)}


def table(
    height: float = 0.0, *, extents: Vector | None = None, name: str = "table", allow_finger_contact: bool = False
) -> Part:
    """A level support surface at ``height`` [m], endless or of a size (x, y) [m] about the origin."""
    part: Part = {"id": name, "normal": [0.0, 0.0, 1.0], "offset": height, "allow_finger_contact": allow_finger_contact}
    return part if extents is None else part | {"extents": _numbers(extents)}


def box(name: str, dimensions: Vector, position: Vector, wxyz: Vector = (1.0, 0.0, 0.0, 0.0)) -> Part:
    """A box obstacle with whole edges [m] about its middle."""
    return _primitive(name, "box", dimensions, position, wxyz)


def sphere(name: str, radius: float, position: Vector) -> Part:
    """A sphere obstacle [m]."""
    return _primitive(name, "sphere", [radius], position, (1.0, 0.0, 0.0, 0.0))


def cylinder(name: str, height: float, radius: float, position: Vector, wxyz: Vector = (1.0, 0.0, 0.0, 0.0)) -> Part:
    """A cylinder obstacle along its z axis [m]."""
    return _primitive(name, "cylinder", [height, radius], position, wxyz)


def capsule(name: str, height: float, radius: float, position: Vector, wxyz: Vector = (1.0, 0.0, 0.0, 0.0)) -> Part:
    """A capsule obstacle along its z axis; ``height`` leaves out the caps [m]."""
    return _primitive(name, "capsule", [height, radius], position, wxyz)


def mesh(name: str, object_id: str, position: Vector, wxyz: Vector = (1.0, 0.0, 0.0, 0.0)) -> Part:
    """An uploaded object as an obstacle."""
    return {"id": name, "object_id": object_id, "pose": pose(position, wxyz)}


def cloud(name: str, points: Any, point_radius: float = 0.0) -> Part:
    """A point cloud (n, 3) [m] in the scene's frame as an obstacle; every point is a ball of a radius."""
    return {"id": name, "points": [_numbers(point) for point in points], "point_radius": point_radius}


def cone(direction: str | Vector, degrees: float = 35.0, frame: str = "world") -> Part:
    """Allowed directions of travel: within an angle of ``down``, ``up``, ``+x``, ``-x``, ``+y``, ``-y`` or a vector."""
    axis = _DIRECTIONS[direction] if isinstance(direction, str) else direction
    return {"axis": _numbers(axis), "max_angle": math.radians(degrees), "frame": frame}


def approach(
    *cones: Part,
    desired_distance: float = 0.10,
    min_distance: float = 0.03,
    required: bool = True,
    retreat: Literal["up", "back"] | Vector = "up",
) -> Part:
    """The way in, along any of the cones (all directions without one), and the way out [m].

    ``retreat`` is up in the scene, back along the palm's z axis, or a direction in the scene.
    """
    if retreat == "back":
        way: Part = {"frame": "palm", "direction": [0.0, 0.0, -1.0]}
    else:
        way = {"frame": "world", "direction": [0.0, 0.0, 1.0] if isinstance(retreat, str) else _numbers(retreat)}
    part: Part = {
        "desired_distance": desired_distance,
        "min_distance": min_distance,
        "required": required,
        "retreat": way,
    }
    return part | {"directions": list(cones)} if cones else part


def scene(
    *obstacles: Part,
    supports: Sequence[Part] = (),
    object_pose: Part | None = None,
    clearance: float = 0.002,
    frame: str = "world",
    gravity: Vector = (0.0, 0.0, -9.81),
    workspace: tuple[Vector, Vector] | None = None,
) -> Part:
    """The world around the object: obstacles, support surfaces, the object's pose, and where the palm may be [m].

    Without ``object_pose`` the object rests on the first support, as a cloud says it stood or else in its likeliest
    stable pose.
    """
    part: Part = {
        "frame": frame,
        "gravity": _numbers(gravity),
        "support_surfaces": list(supports),
        "obstacles": list(obstacles),
        "clearance": clearance,
    }
    if object_pose is not None:
        part["object_pose"] = object_pose
    if workspace is not None:
        part["workspace"] = {"min": _numbers(workspace[0]), "max": _numbers(workspace[1])}
    return part


def _primitive(name: str, kind: str, dimensions: Vector, position: Vector, wxyz: Vector) -> Part:
    return {
        "id": name,
        "pose": pose(position, wxyz),
        "primitive": {"type": kind, "dimensions": _numbers(dimensions)},
    }


def _numbers(values: Vector) -> list[float]:
    return [float(value) for value in values]
