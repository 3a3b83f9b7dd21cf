"""Requests as documents: what is read is what is written, and every error names its entry."""

import json
from math import nan, pi

import jsonschema_rs
import numpy as np
import pytest

from fingersplit.errors import SceneError
from fingersplit.scene import (
    Approach,
    ApproachCone,
    Constraints,
    Obstacle,
    Pose,
    Primitive,
    Retreat,
    Scene,
    SupportSurface,
    Task,
    Workspace,
    Wrench,
)

FULL = {
    "scene": {
        "frame": "base_link",
        "object_pose": {"position": [0.4, 0.1, 0.02], "wxyz": [1, 0, 0, 0]},
        "gravity": [0, 0, -9.81],
        "support_surfaces": [
            {"id": "table", "normal": [0, 0, 1], "offset": 0.0, "extents": [1.2, 0.8], "allow_finger_contact": True}
        ],
        "obstacles": [
            {"id": "wall", "pose": {}, "primitive": {"type": "box", "dimensions": [0.4, 0.02, 0.15]}},
            {"id": "clutter", "object_id": "abc", "pose": {"position": [0, 0, 1]}},
            {"id": "cloud", "points": [[0, 0, 0], [1, 2, 3]], "point_radius": 0.004},
        ],
        "clearance": 0.003,
        "workspace": {"min": [-1, -1, 0], "max": [1, 1, 1]},
    },
    "approach": {
        "directions": [
            {"frame": "base_link", "axis": [0, 0, -1], "max_angle": 0.6},
            {"frame": "object", "axis": [1, 0, 0]},
        ],
        "desired_distance": 0.10,
        "min_distance": 0.03,
        "required": True,
        "retreat": {"frame": "palm", "direction": [0, 0, -1], "desired_distance": 0.10, "min_distance": 0.02},
    },
    "contact_regions": {
        "allowed": [{"type": "half_space", "normal": [0, 0, 1], "offset": 0.1}],
        "forbidden": [
            {"type": "box", "pose": {}, "dimensions": [0.1, 0.1, 0.1]},
            {"type": "sphere", "radius": 0.01},
            {"type": "near_cloud", "points": [[0, 0, 0]], "distance": 0.01},
            {"type": "faces", "faces": [0, 5, 7]},
        ],
    },
    "task": {"wrenches": [{"frame": "object", "point": [0, 0, 0], "force": [0, 0, 1]}], "gravity": "scene"},
    "end_effector": {
        "tool_frame": "tool0",
        "tool_from_palm": {"position": [0, 0, 0.1]},
        "attached_bodies": [{"pose": {}, "primitive": {"type": "cylinder", "dimensions": [0.1, 0.04]}}],
        "reach": {"center": [0, 0, 0], "min_radius": 0.25, "max_radius": 0.85},
    },
}


def test_a_document_is_read_and_written_unchanged():
    constraints = Constraints.from_document(FULL)
    written = json.loads(json.dumps(constraints.to_document()))
    assert Constraints.from_document(written).to_document() == written
    for part, entries in FULL.items():
        assert set(entries) <= set(written[part])
    assert written["scene"]["obstacles"][2]["points"] == [[0, 0, 0], [1, 2, 3]]
    assert Constraints.from_document({}).to_document() == Constraints().to_document()


@pytest.mark.parametrize("document", [FULL, {}, {"scene": {"object_pose": None}}, Constraints().to_document()])
def test_the_schema_accepts_what_is_read(document):
    Constraints.from_document(document)
    jsonschema_rs.validate(Constraints.json_schema(), document)


def changed(path: str, value: object) -> dict:
    """The full document with one entry replaced, or added."""
    document = json.loads(json.dumps(FULL))
    *way, last = [int(step) if step.isdigit() else step for step in path.split(".")]
    place = document
    for step in way:
        place = place[step]
    place[last] = value
    return document


BAD = [
    ("scen", {}, "scen"),
    ("scene", [], "scene"),
    ("scene.clearance", nan, "scene.clearance"),
    ("scene.clearance", -1e-3, "scene.clearance"),
    ("scene.clearance", True, "scene.clearance"),
    ("scene.gravity", [0, 0], "scene.gravity"),
    ("scene.object_pose.wxyz", [0, 0, 0, 0], "scene.object_pose.wxyz"),
    ("scene.object_pose.position", [0, nan, 0], "scene.object_pose.position"),
    ("scene.frame", "object", "scene.frame"),
    ("scene.obstacles.0.primitive.dimensions", [1, 2], "scene.obstacles[0].primitive.dimensions"),
    ("scene.obstacles.0.primitive.dimensions", [1, 2, nan], "scene.obstacles[0].primitive.dimensions"),
    ("scene.obstacles.0.primitive.type", "cone", "scene.obstacles[0].primitive.type"),
    ("scene.obstacles.0.id", "table", "scene.obstacles[0].id"),
    ("scene.obstacles.1", {"id": "nothing"}, "scene.obstacles[1].primitive"),
    ("scene.obstacles.2.points", [[0, 0, nan]], "scene.obstacles[2].points"),
    ("scene.obstacles.2.points", [], "scene.obstacles[2].points"),
    ("scene.obstacles.2.points", [[1, 2], [3]], "scene.obstacles[2].points"),
    ("scene.obstacles", [{"id": str(i), "primitive": {}} for i in range(10_000)], "scene.obstacles"),
    ("scene.support_surfaces.0.normal", [0, 0, 0], "scene.support_surfaces[0].normal"),
    ("scene.workspace.max", [-2, 1, 1], "scene.workspace.max"),
    ("approach.directions", [], "approach.directions"),
    ("approach.directions.1.max_angle", 0, "approach.directions[1].max_angle"),
    ("approach.directions.1.axis", [0, 0, 0], "approach.directions[1].axis"),
    ("approach.directions.0.frame", "elsewhere", "approach.directions[0].frame"),
    ("approach.min_distance", 0.2, "approach.min_distance"),
    ("approach.retreat.frame", "tool", "approach.retreat.frame"),
    ("contact_regions.forbidden.0", {"type": "box"}, "contact_regions.forbidden[0].dimensions"),
    ("contact_regions.forbidden.1.offset", 1, "contact_regions.forbidden[1].offset"),
    ("contact_regions.forbidden.3.faces", [0.5], "contact_regions.forbidden[3].faces"),
    ("contact_regions.forbidden.3.faces", [-1], "contact_regions.forbidden[3].faces"),
    ("task.wrenches.0.frame", "tool", "task.wrenches[0].frame"),
    ("task.gravity", "down", "task.gravity"),
    ("end_effector.reach.min_radius", 2, "end_effector.reach.max_radius"),
    ("end_effector.attached_bodies.0", {}, "end_effector.attached_bodies[0].primitive"),
]


@pytest.mark.parametrize(("path", "value", "field"), BAD, ids=[f"{path}-{n}" for n, (path, _, _) in enumerate(BAD)])
def test_errors_name_the_entry(path, value, field):
    with pytest.raises(SceneError) as caught:
        Constraints.from_document(changed(path, value))
    assert caught.value.field == field
    assert str(caught.value).startswith(field)


def test_python_callers_get_the_same_errors():
    with pytest.raises(SceneError, match="dimensions"):
        Primitive("sphere", (1.0, 2.0))
    with pytest.raises(SceneError) as caught:
        Scene(obstacles=(Obstacle("a", primitive=Primitive.sphere(0.1)), "b"))  # type: ignore[arg-type]
    assert caught.value.field == "obstacles[1]"


def test_directions_have_short_names():
    cone = ApproachCone.parse("down:35")
    assert cone.axis == (0, 0, -1)
    assert cone.max_angle == pytest.approx(35 * pi / 180)
    assert ApproachCone.parse("-x").axis == (-1, 0, 0)
    for bad in ("sideways", "down:x", "down:0", "down:nan"):
        with pytest.raises(SceneError):
            ApproachCone.parse(bad)


def test_cones_are_turned_into_the_object_frame():
    quarter = Pose(wxyz=(np.sqrt(0.5), np.sqrt(0.5), 0, 0)).matrix  # the object's y is the world's z
    cones = (ApproachCone((0, 0, -1), 0.5), ApproachCone((1, 0, 0), 0.1, "object"))
    axes, cosines = Approach(directions=cones).cones(quarter)
    np.testing.assert_allclose(axes, [[0, -1, 0], [1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(cosines, np.cos([0.5, 0.1]))


def test_supports_have_a_frame_on_the_plane():
    surface = SupportSurface(normal=(1, 2, 2), offset=0.3)
    pose = surface.scene_from_surface
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(pose[:3, 2], np.array([1, 2, 2]) / 3)
    assert pose[:3, 3] @ surface.normal == pytest.approx(0.3)


def test_loads_combine_weight_and_wrenches():
    world_from_object = Pose(position=(1, 2, 3), wxyz=(np.sqrt(0.5), np.sqrt(0.5), 0, 0)).matrix
    center, gravity = np.array([0.01, 0.02, 0.03]), np.array([0, 0, -10.0])
    weight = Task(gravity="scene").loads(0.5, center, gravity, world_from_object)
    np.testing.assert_allclose(weight, [[0, -5, 0, 0, 0, 0]], atol=1e-12)
    assert Task().loads(0.5, center, gravity, world_from_object).shape == (6, 6)
    at = (world_from_object @ [0.11, 0.02, 0.03, 1])[:3]
    push = Wrench(force=(0, 0, -2), point=tuple(at), frame="world")
    alone, load = Task((push,), "scene").loads(0.5, center, gravity, world_from_object)
    np.testing.assert_allclose(alone, weight[0], atol=1e-12)
    np.testing.assert_allclose(load, [0, -7, 0, 0, 0, 0.1 * -2], atol=1e-12)


def test_a_workspace_needs_a_volume_and_a_retreat_a_way():
    with pytest.raises(SceneError, match="along z"):
        Workspace((0, 0, 0), (1, 1, 0))
    with pytest.raises(SceneError, match="min_distance"):
        Retreat(min_distance=0.2)
