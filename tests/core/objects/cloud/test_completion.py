"""Clouds from one view of an object on a known support: what is assumed of the side that was not seen."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from fingersplit.cli.main import app
from fingersplit.cli.scenes import support_in_file
from fingersplit.errors import ObjectFileError, SceneError
from fingersplit.objects.cloud import PointCloud
from fingersplit.objects.intake import read_bytes
from fingersplit.objects.loading import load_object
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.parametric import box, cylinder, sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.scatter import scatter
from fingersplit.objects.source import ObjectSource
from fingersplit.planning.planning import plan
from fingersplit.result.plan import PlanResult
from fingersplit.scene import Constraints, Scene, SupportSurface
from fingersplit.scene.from_view import scene_from_view
from fingersplit.scene.preparing import prepare_scene
from fingersplit.scene.shapes import Pose
from fingersplit.transforms import rotation_from_wxyz, transform_points
from fingersplit_bench.depth_views import Camera, look_at, render_view

CAMERA = Camera(160, 120, 150.0)
WORLD_FROM_CAMERA = look_at(np.array([0.4, -0.1, 0.4]), np.array([0.0, 0.0, 0.05]))
PIXEL = 4e-3
"""[m]; what one shows of the object."""
SHAPES = {"box": box((0.06, 0.05, 0.12)), "cylinder": cylinder(0.03, 0.11), "sphere": sphere(0.035)}
TURN = rotation_from_wxyz((np.cos(0.3), 0.0, 0.0, np.sin(0.3)))


def standing(mesh: Mesh) -> Mesh:
    """The mesh on the plane z = 0, turned so that no face looks along an axis."""
    turned = mesh.vertices @ TURN.T
    return Mesh(turned - [0.0, 0.0, turned[:, 2].min()], mesh.faces)


def viewed(mesh: Mesh, complete: bool = True) -> PointCloud:
    view = render_view(mesh, np.eye(4), WORLD_FROM_CAMERA, CAMERA)
    return scene_from_view(view, support=True, complete=complete).target


@pytest.mark.parametrize("name", SHAPES)
def test_symmetric_objects_are_completed_as_they_are(exact_mesh, name):
    mesh = standing(SHAPES[name])
    model = prepare_object(viewed(mesh), name)

    in_world = transform_points(WORLD_FROM_CAMERA, model.surface.grid.points)
    above = in_world[in_world[:, 2] > 0.02]  # below a ball there is no telling
    errors = exact_mesh(mesh).distance(above[:: max(1, len(above) // 400)])
    assert np.percentile(errors, 80) < 1.5 * PIXEL
    assert np.percentile(errors, 95) < 2.5 * PIXEL
    assert model.mesh.watertight
    assert model.mesh.volume == pytest.approx(mesh.volume, rel=0.2)
    assert in_world[:, 2].min() > -4e-3
    assert 0.2 < model.assumed < 0.8
    assert model.seen == pytest.approx(1.0 - model.assumed)
    assert model.to_document()["assumed"] == model.assumed


def test_grasps_touch_both_sides_and_say_how_much_was_assumed(barrett):
    cloud = viewed(standing(SHAPES["cylinder"]))

    result = plan(prepare_object(cloud), barrett, starts=24)

    assert result.feasible > 0
    assert 0.2 < result.object.assumed < 0.8
    contacts = [contact for grasp in result.grasps for contact in grasp.contacts]
    places = np.array([contact.position for contact in contacts])
    gaps = np.linalg.norm(cloud.points[:, None] - places, axis=2).min(axis=0)
    assumed = np.array([contact.assumed for contact in contacts])
    assert gaps.max() > 0.01  # on what was not seen
    assert assumed[gaps > 0.01].all()
    assert not assumed[gaps < 0.5 * PIXEL].any()
    for grasp in result.grasps:
        assert ("not seen" in grasp.reason) == bool(grasp.assumed_fingers) or not grasp.feasible
        assert all(finger in grasp.reason for finger in grasp.assumed_fingers if grasp.feasible)
    again = PlanResult.from_dict(result.to_dict())
    assert [grasp.assumed_fingers for grasp in again.grasps] == [grasp.assumed_fingers for grasp in result.grasps]


def test_nothing_is_assumed_unless_the_support_is_known_and_it_is_asked_for():
    cloud = viewed(standing(SHAPES["cylinder"]), complete=False)

    assert cloud.support is None
    model = prepare_object(cloud)
    assert model.assumed == 0.0
    gaps = np.linalg.norm(cloud.points[:, None] - model.surface.grid.points[::20], axis=2).min(axis=0)
    assert gaps.max() < 0.01


def test_what_the_camera_saw_to_be_free_stays_free():
    cloud = viewed(standing(SHAPES["box"]))
    vertices = prepare_object(cloud).mesh.vertices

    directions = cloud.points / np.linalg.norm(cloud.points, axis=1, keepdims=True)
    cosines = vertices @ directions.T / np.linalg.norm(vertices, axis=1, keepdims=True)
    same_ray = cosines.argmax(axis=1)
    ahead = np.linalg.norm(cloud.points[same_ray], axis=1) - np.linalg.norm(vertices, axis=1)
    gaps = np.linalg.norm(cloud.points[:, None] - vertices[ahead > 0], axis=2).min(axis=0)
    assert gaps.max() < 1.5 * PIXEL  # what lies before a measured point is part of the surface through it
    beside = np.sqrt(np.maximum(1 - cosines.max(axis=1) ** 2, 0.0)) * np.linalg.norm(vertices, axis=1)
    assert np.percentile(beside, 99) < 1.5 * PIXEL


def test_the_support_tells_clouds_apart():
    cloud = viewed(standing(SHAPES["sphere"]))
    without = PointCloud(cloud.points, viewpoint=cloud.viewpoint)
    other = PointCloud(cloud.points, viewpoint=cloud.viewpoint, support=cloud.support * [1, 1, 1, 1.001])
    assert len({cloud.content_hash, without.content_hash, other.content_hash}) == 3


def npz(**arrays: object) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def test_a_file_says_what_the_object_stands_on():
    cloud = viewed(standing(SHAPES["sphere"]))
    arrays = cloud.to_arrays()
    plane = np.append(3.0 * cloud.support[:3], 3.0 * 1e3 * cloud.support[3])  # any length, in the file's unit
    content = npz(points=1e3 * arrays["points"], viewpoint=arrays["viewpoint"], support=plane)

    read, report = read_bytes(content, "npz", ObjectSource("mm"))

    assert np.allclose(read.support, cloud.support)
    assert report.support
    assert any("assumed" in remark for remark in report.remarks)
    assert not read_bytes(npz(points=arrays["points"]), "npz")[1].support


@pytest.mark.parametrize(
    ("support", "code", "message"),
    [
        ([0.0, 0.0, 1.0], "malformed", "'support' has the shape"),
        ([0.0, 0.0, 0.0, 1.0], "non_finite", "a normal, not 0"),
        ([0.0, 0.0, np.nan, 1.0], "non_finite", "a normal, not 0"),
        ([0.0, 0.0, 1.0, 1.0], "below_support", "below the support"),
    ],
)
def test_supports_that_are_none_are_refused(support, code, message):
    points = np.random.default_rng(0).normal(size=(600, 3))
    points *= 0.03 / np.linalg.norm(points, axis=1, keepdims=True)
    with pytest.raises(ObjectFileError, match=message) as refusal:
        read_bytes(npz(points=points, viewpoint=np.array([0.0, 0.0, 0.5]), support=np.array(support)), "npz")
    assert refusal.value.code == code


def test_a_scene_says_what_the_object_of_a_cloud_stands_on(tmp_path):
    cloud = viewed(standing(SHAPES["sphere"]))
    turned = Pose((0.3, -0.2, 0.7), (0.5, 0.5, 0.5, 0.5)).matrix  # world_from_object
    normal = turned[:3, :3] @ cloud.support[:3]
    scene = Scene(
        object_pose=Pose.from_matrix(turned),
        gravity=tuple((-9.81 * normal).tolist()),
        support_surfaces=(
            SupportSurface(normal=tuple(normal.tolist()), offset=float(cloud.support[3] + normal @ turned[:3, 3])),
        ),
    )
    assert scene.support_in_object == pytest.approx(cloud.support, abs=1e-9)
    assert replace(scene, object_pose=None).support_in_object is None
    file = tmp_path / "seen.npz"
    file.write_bytes(npz(points=1e3 * cloud.points, viewpoint=1e3 * cloud.viewpoint))
    support = support_in_file(scene, ObjectSource("mm"), file)
    refused = tmp_path / "refused.npz"
    refused.write_bytes(npz(points=cloud.points, complete=np.array(False)))
    assert support_in_file(scene, ObjectSource(), refused) is None
    model = load_object(file, unit="mm", support=support)
    assert model.assumed > 0.2
    assert load_object(file, unit="mm").assumed == 0
    assert ObjectSource.from_document(model.source.to_document()) == model.source


def test_a_support_of_three_numbers_is_refused():
    with pytest.raises(ObjectFileError, match="four numbers"):
        ObjectSource(support=(0.0, 0.0, 1.0))


ON_TABLE = Constraints(Scene(support_surfaces=(SupportSurface(offset=0.7),)))


def test_an_object_rests_on_a_table_as_its_cloud_stood(barrett):
    cloud = viewed(standing(SHAPES["box"]))
    model = prepare_object(cloud)
    arrays = model.to_arrays()
    for one in (model, ObjectModel.from_arrays(arrays, "box", model.options, model.source, None)):
        prepared = prepare_scene(ON_TABLE, one, barrett)
        in_world = transform_points(prepared.world_from_object, cloud.points)
        assert in_world[:, 2] - 0.7 == pytest.approx(cloud.points @ cloud.support[:3] - cloud.support[3], abs=1e-9)
        assert np.linalg.det(prepared.world_from_object[:3, :3]) == pytest.approx(1.0)
        assert prepared.stable_pose_share is None


def test_how_a_cloud_that_shows_one_side_rests_has_to_be_said(barrett):
    model = prepare_object(viewed(standing(SHAPES["box"]), complete=False))
    with pytest.raises(SceneError, match=r"object_pose is needed: .* shows one side"):
        prepare_scene(ON_TABLE, model, barrett)
    posed = replace(ON_TABLE.scene, object_pose=Pose((0.0, 0.0, 0.8)))
    assert prepare_scene(Constraints(posed), model, barrett).world_from_object[2, 3] == 0.8

    points, _ = scatter(SHAPES["box"], 3_000, np.random.default_rng(0))
    all_around = prepare_object(PointCloud(points))
    assert prepare_scene(ON_TABLE, all_around, barrett).stable_pose_share is not None


def test_a_support_on_the_command_line_completes_a_cloud_and_is_its_table(tmp_path):
    cloud = viewed(standing(SHAPES["cylinder"]))
    file, result = tmp_path / "seen.npz", tmp_path / "result.json"
    file.write_bytes(npz(points=cloud.points))
    view = [f"{number:.6g}" for number in cloud.viewpoint]
    plane = [f"{number:.6g}" for number in cloud.support]
    arguments = ["plan", str(file), "--table", "--starts", "8", "--json", str(result), "--viewpoint", *view]

    planned = CliRunner().invoke(app, [*arguments, "--support", *plane])
    assert planned.exit_code in (0, 1), planned.output
    document = PlanResult.from_dict(json.loads(result.read_text()))
    assert document.object.assumed > 0.2
    assert document.scene.stable_pose_share is None
    refused = CliRunner().invoke(app, arguments)
    assert "shows one side" in str(refused.exception)
