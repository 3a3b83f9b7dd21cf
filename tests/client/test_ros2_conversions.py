"""Conversions of the ROS 2 example, with messages that only have the fields: no ROS is installed."""

import importlib.util
import json
from pathlib import Path
from types import SimpleNamespace as Message

import pytest

from fingersplit.scene import Constraints
from fingersplit_client import Client, PlanResult

PATH = Path(__file__).parents[2] / "examples" / "ros2" / "conversions.py"
spec = importlib.util.spec_from_file_location("conversions", PATH)
assert spec is not None
assert spec.loader is not None
conversions = importlib.util.module_from_spec(spec)
spec.loader.exec_module(conversions)

HALF = 0.5**0.5


def point(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Message:
    return Message(x=x, y=y, z=z)


def pose(position: Message, w: float = 1.0, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Message:
    return Message(position=position, orientation=Message(w=w, x=x, y=y, z=z))


def collision_object(name: str, **fields: object) -> Message:
    empty = {"meshes": [], "mesh_poses": [], "primitives": [], "primitive_poses": []}
    return Message(**{"id": name, "header": Message(frame_id="base"), "pose": pose(point()), **empty, **fields})


TETRAHEDRON = Message(
    vertices=[point(), point(0.1), point(0, 0.1), point(0, 0, 0.1)],
    triangles=[Message(vertex_indices=indices) for indices in ([0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3])],
)


def test_meshes_of_a_target_are_moved_and_joined() -> None:
    turned = pose(point(1.0), w=HALF, z=HALF)  # a quarter turn about z
    target = collision_object("part", meshes=[TETRAHEDRON, TETRAHEDRON], mesh_poses=[pose(point()), turned])
    vertices, triangles = conversions.mesh_of(target)
    assert len(vertices) == 8
    assert vertices[5] == pytest.approx((1.0, 0.1, 0.0))
    assert triangles[4] == (4, 6, 5)
    with pytest.raises(ValueError, match="'bare' has no mesh"):
        conversions.mesh_of(collision_object("bare"))


def test_a_scene_is_one_that_the_planner_reads() -> None:
    box = Message(type=1, dimensions=[0.1, 0.2, 0.3])
    cylinder = Message(type=3, dimensions=[0.4, 0.05])
    shelf = collision_object(
        "shelf",
        pose=pose(point(0, 0, 1.0), w=HALF, x=HALF),
        primitives=[box, cylinder],
        primitive_poses=[pose(point(0, 0.5)), pose(point())],
        meshes=[TETRAHEDRON],
        mesh_poses=[pose(point())],
    )
    target = collision_object("part", pose=pose(point(0.5, 0.1)))
    scene = conversions.scene_of(target, [shelf], ["table"])
    read = Constraints.from_document({"scene": scene}).scene
    assert read.frame == "base"
    first, second, third = read.obstacles
    assert first.primitive.type == "box"
    assert list(scene["obstacles"][0]["pose"]["position"]) == pytest.approx([0, 0, 1.5])
    assert second.primitive.dimensions == (0.4, 0.05)
    assert len(third.points) == 4
    assert [surface.id for surface in read.support_surfaces] == ["table"]
    cone = collision_object("x", primitives=[Message(type=4, dimensions=[1, 1])], primitive_poses=[pose(point())])
    with pytest.raises(ValueError, match="a primitive of type 4"):
        conversions.scene_of(target, [cone], [])


def test_grasps_stand_in_the_frame_of_the_target(service: str, result: PlanResult) -> None:
    target = collision_object("can", pose=pose(point(0.5, 0.2, 0.3), w=HALF, z=HALF))
    with Client(service) as client:
        fields = conversions.grasp_fields(client.jobs.export(str(result.job_id), "moveit"), target)
    exported = result.grasps[int(fields[0]["id"].removeprefix("grasp_")) - 1]
    placed = exported.in_frame(((0.5, 0.2, 0.3), (HALF, 0, 0, HALF)), "base")
    assert list(fields[0]["grasp_pose"]["pose"]["position"].values()) == pytest.approx(placed.pose.position)
    turn = fields[0]["grasp_pose"]["pose"]["orientation"]
    assert [turn[axis] for axis in "wxyz"] == pytest.approx(placed.pose.wxyz)
    assert fields[0]["grasp_pose"]["header"]["frame_id"] == "base"
    assert set(fields[0]) == {
        *("id", "pre_grasp_posture", "grasp_posture", "grasp_pose", "grasp_quality", "pre_grasp_approach"),
        *("post_grasp_retreat", "post_place_retreat", "max_contact_force", "allowed_touch_objects"),
    }
    assert json.dumps(fields)
