"""Depth images cut into target and scene, against rendered ones whose truth is known."""

import numpy as np
import pytest
from PIL import Image

from fingersplit.errors import SceneError
from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit.scene import Constraints
from fingersplit.scene.from_view import SPACING, scene_from_view
from fingersplit.scene.view import View
from fingersplit.scene.view_files import read_view
from fingersplit.transforms import transform_points
from fingersplit_bench.depth_views import Camera, look_at, render_view

CAMERA = Camera(160, 120, 150.0)
EXTENTS = (0.06, 0.05, 0.12)
ON_TABLE = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, EXTENTS[2] / 2], [0, 0, 0, 1.0]])
LIFTED = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 1.0, 0.2], [0, 0, 0, 1.0]])
CAMERA_POSE = look_at(np.array([0.4, -0.1, 0.4]), np.array([0.0, 0.0, 0.05]))


@pytest.fixture(scope="module")
def view():
    return render_view(box(EXTENTS), ON_TABLE, CAMERA_POSE, CAMERA)


@pytest.mark.parametrize("frame", ["world", "camera"])
def test_the_table_is_found_where_it_is(view, frame):
    found = scene_from_view(view, frame=frame, support=True)

    surface = found.scene.support_surfaces[0]
    world_from_scene = np.eye(4) if frame == "world" else CAMERA_POSE
    normal = world_from_scene[:3, :3] @ surface.normal
    point = transform_points(world_from_scene, np.array([surface.offset * np.array(surface.normal)]))[0]
    assert normal @ (0, 0, 1) > 0.9999
    assert abs(point @ normal) < 1e-3
    assert found.obstacle_points == 0  # nothing stands on it
    assert found.support_points > 1000
    assert np.allclose(world_from_scene[:3, :3] @ found.scene.gravity, (0, 0, -9.81), atol=1e-6)


def test_the_target_lies_on_the_object(view):
    found = scene_from_view(view)

    in_world = transform_points(found.scene.world_from_object, found.target.points)
    outside = np.abs(in_world - ON_TABLE[:3, 3]) - np.array(EXTENTS) / 2
    assert outside.max() < 3e-3
    assert in_world[:, 2].max() > EXTENTS[2] - 5e-3
    assert np.array_equal(found.target.viewpoint, np.zeros(3))


def test_every_obstacle_that_was_measured_is_covered(view):
    found = scene_from_view(view)  # the table counts as an obstacle, since no support was asked for

    cloud = found.scene.obstacles[0]
    measured = view.points[np.isfinite(view.points).all(axis=2) & ~view.mask]
    middle = np.median(view.points[view.mask], axis=0)
    near = measured[np.linalg.norm(measured - middle, axis=1) < 0.3]
    gaps = np.array([np.linalg.norm(cloud.points - point, axis=1).min() for point in near[::20]])
    assert np.quantile(gaps, 0.9) <= SPACING  # but for pixels beside the target


def test_a_grasp_keeps_clear_of_the_table(view):
    found = scene_from_view(view, support=True)
    hand = load_hand("barrett")

    search = find_grasps(prepare_object(found.target), hand, starts=16, seed=1, constraints=Constraints(found.scene))

    assert search.feasible > 0
    for run in search.runs:
        if run.feasible:
            links = hand.shape_poses(run.final.joints, run.final.object_from_palm)
            lowest = min(
                transform_points(CAMERA_POSE @ link, mesh.vertices)[:, 2].min()
                for link, mesh in zip(links, hand.shape_meshes, strict=True)
            )
            assert lowest > 0.0


def test_an_object_seen_from_above_stands_on_its_support():
    above = look_at(np.array([0.02, 0.0, 0.6]), np.array([0.0, 0.0, 0.05]))
    found = scene_from_view(render_view(box(EXTENTS), ON_TABLE, above, CAMERA), support=True)

    surface = found.scene.support_surfaces[0]
    assert surface.normal[2] > 0.999
    assert surface.offset == pytest.approx(0.0, abs=2e-3)
    assert any("not seen" in warning for warning in found.warnings)
    model = prepare_object(found.target)
    heights = transform_points(above, model.mesh.vertices)[:, 2]
    assert heights.min() < 0.01  # completed down to it
    assert heights.max() == pytest.approx(EXTENTS[2], abs=6e-3)


def test_an_object_in_the_air_has_no_support():
    lifted = render_view(box(EXTENTS), LIFTED, CAMERA_POSE, CAMERA)
    with pytest.raises(SceneError, match=r"support was not found"):
        scene_from_view(lifted, support=True)


def test_without_a_pose_the_answer_is_in_the_cameras_frame(view):
    bare = View(view.points, view.mask)
    with pytest.raises(SceneError, match="camera_pose is needed"):
        scene_from_view(bare)
    found = scene_from_view(bare, frame="camera", support=True)
    assert np.array_equal(found.scene.world_from_object, np.eye(4))
    assert "Gravity" in found.warnings[0]
    assert np.allclose(CAMERA_POSE[:3, :3] @ found.scene.gravity, (0, 0, -9.81), atol=0.05)


def test_files_give_the_same_view(view, tmp_path):
    depth = np.nan_to_num(view.points[..., 2])
    np.savez(
        tmp_path / "view.npz", depth=depth, mask=view.mask, intrinsics=CAMERA.intrinsics, world_from_camera=CAMERA_POSE
    )
    np.savez(tmp_path / "cloud.npz", points=view.points, mask=view.mask)
    Image.fromarray((1e3 * depth).round().astype(np.uint16)).save(tmp_path / "depth.png")
    Image.fromarray(255 * view.mask.astype(np.uint8)).save(tmp_path / "mask.png")

    archive = read_view(tmp_path / "view.npz")
    cloud = read_view(tmp_path / "cloud.npz", world_from_camera=CAMERA_POSE)
    image = read_view(tmp_path / "depth.png", tmp_path / "mask.png", intrinsics=CAMERA.intrinsics)
    for read, off in ((archive, 1e-9), (cloud, 1e-12), (image, 1.5e-3)):
        assert np.array_equal(read.mask, view.mask)
        assert np.nanmax(np.abs(read.points - view.points)) < off


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mask": np.zeros((4, 4), bool)}, "mask has the size"),
        ({"intrinsics": [1, 2]}, "intrinsics must be"),
        ({"intrinsics": [0, 100, 80, 60]}, "intrinsics must be"),
        ({"depth": np.zeros(5)}, "depth must be an image"),
        ({"depth_scale": -1.0}, "depth_scale is -1.0"),
        ({"world_from_camera": np.ones((4, 4))}, "camera_pose must be"),
    ],
)
def test_bad_entries_are_named(change, message):
    entries = {
        "depth": np.ones((120, 160)),
        "mask": np.ones((120, 160), bool),
        "intrinsics": CAMERA.intrinsics,
    }
    given = entries | change
    with pytest.raises(SceneError, match=message):
        View.from_depth(given.pop("depth"), given.pop("mask"), given.pop("intrinsics"), **given)


def test_a_mask_without_measurements_is_refused(view):
    with pytest.raises(SceneError, match="mask has 0 measured pixels"):
        scene_from_view(View(np.full_like(view.points, np.nan), view.mask, CAMERA_POSE))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 broken", b"\x89PNG broken"])
@pytest.mark.parametrize("suffix", [".npz", ".png", ".txt"])
def test_broken_files_are_refused(tmp_path, content, suffix):
    path = tmp_path / f"view{suffix}"
    path.write_bytes(content)
    with pytest.raises(SceneError, match="file"):
        read_view(path)
