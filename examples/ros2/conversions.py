"""Between moveit_msgs and Fingersplit, without ROS: messages are read by their fields, answers are plain dicts.

`rosidl_runtime_py.set_message_fields` makes messages of the dicts.
"""

import json
from typing import Any

__all__ = ["FAILURE", "SUCCESS", "grasp_fields", "mesh_of", "scene_of"]

SUCCESS, FAILURE = 1, 99999
"""Of moveit_msgs/MoveItErrorCodes."""
SHAPES = {1: ("box", ("x", "y", "z")), 2: ("sphere", ("radius",)), 3: ("cylinder", ("height", "radius"))}
"""Types of shape_msgs/SolidPrimitive."""


def mesh_of(target: Any) -> tuple[list[tuple[float, ...]], list[tuple[int, ...]]]:
    """Vertices [m] and triangles of a moveit_msgs/CollisionObject, in the object's frame.

    Raises:
        ValueError: It has no mesh.
    """
    if not target.meshes:
        raise ValueError(f"The target {target.id!r} has no mesh.")
    vertices, triangles = [], []
    for mesh, pose in zip(target.meshes, target.mesh_poses, strict=True):
        first = len(vertices)
        vertices += [_moved(pose, (point.x, point.y, point.z)) for point in mesh.vertices]
        triangles += [tuple(first + int(i) for i in one.vertex_indices) for one in mesh.triangles]
    return vertices, triangles


def scene_of(target: Any, obstacles: list[Any], support_surfaces: list[str]) -> dict[str, Any]:
    """A scene in the target's header frame: the target's pose, and primitives and meshes' corners as obstacles."""
    found = [one for item in obstacles for one in _obstacles(item)]
    surfaces = [{"id": name} for name in support_surfaces[:1] if name not in {item.id for item in obstacles}]
    return {
        "frame": target.header.frame_id or "world",
        "object_pose": _pose(target.pose),
        "obstacles": found,
        "support_surfaces": surfaces,
    }


def grasp_fields(exported: bytes, target: Any) -> list[dict[str, Any]]:
    """Fields of moveit_msgs/Grasp for each grasp of a MoveIt export, poses in the target's header frame."""
    messages = json.loads(exported)["grasps"]
    for message in messages:
        pose = message["grasp_pose"]["pose"]
        position, turn = pose["position"], pose["orientation"]
        placed = _moved(target.pose, tuple(position.values()))
        turned = _product(_wxyz(target.pose), (turn["w"], turn["x"], turn["y"], turn["z"]))
        message["grasp_pose"]["header"]["frame_id"] = target.header.frame_id
        pose["position"] = dict(zip("xyz", placed, strict=True))
        pose["orientation"] = dict(zip("wxyz", turned, strict=True))
    return messages


def _obstacles(item: Any) -> list[dict[str, Any]]:
    found = []
    for number, (primitive, pose) in enumerate(zip(item.primitives, item.primitive_poses, strict=True)):
        if primitive.type not in SHAPES:
            raise ValueError(f"Obstacle {item.id!r} has a primitive of type {primitive.type}; known are 1, 2 and 3.")
        name, sizes = SHAPES[primitive.type]
        described = {"type": name, "dimensions": [float(size) for size in primitive.dimensions[: len(sizes)]]}
        found.append({"id": f"{item.id}_{number}", "pose": _joined(item.pose, pose), "primitive": described})
    for number, (mesh, pose) in enumerate(zip(item.meshes, item.mesh_poses, strict=True)):
        points = [[point.x, point.y, point.z] for point in mesh.vertices]
        described = {"points": points, "point_radius": 0.005}
        found.append({"id": f"{item.id}_mesh_{number}", "pose": _joined(item.pose, pose), **described})
    return found


def _wxyz(pose: Any) -> tuple[float, ...]:
    turn = pose.orientation
    return (turn.w, turn.x, turn.y, turn.z) if turn.w or turn.x or turn.y or turn.z else (1.0, 0.0, 0.0, 0.0)


def _pose(pose: Any) -> dict[str, Any]:
    return {"position": [pose.position.x, pose.position.y, pose.position.z], "wxyz": list(_wxyz(pose))}


def _joined(outer: Any, inner: Any) -> dict[str, Any]:
    """Pose of something in an object that itself has a pose."""
    position = _moved(outer, (inner.position.x, inner.position.y, inner.position.z))
    return {"position": list(position), "wxyz": list(_product(_wxyz(outer), _wxyz(inner)))}


def _moved(pose: Any, point: tuple[float, ...]) -> tuple[float, ...]:
    w, x, y, z = _wxyz(pose)
    turned = _product(_product((w, x, y, z), (0.0, *point)), (w, -x, -y, -z))
    place = pose.position
    return (turned[1] + place.x, turned[2] + place.y, turned[3] + place.z)


def _product(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    """Of two quaternions, wxyz."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
