"""Clouds from one view and from all around: normals, the surface through them, and what counts as unseen."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from fingersplit.errors import ObjectFileError
from fingersplit.objects.cloud import MIN_POINTS, PointCloud, close_cloud
from fingersplit.objects.cloud.checks import contradict
from fingersplit.objects.cloud.normals import find_outliers, orient_points
from fingersplit.objects.cloud.unseen import estimate_viewpoint
from fingersplit.objects.cloud.visibility import look_from_all_sides
from fingersplit.objects.intake import read_file
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.scatter import scatter
from fingersplit.objects.signed_distance_kernel import rough_distance
from fingersplit.planning.planning import plan
from one_view import one_view

RADIUS = 0.035  # of the parametric sphere
FROM_ABOVE = (0.3, 0.2, 1.0)


def all_around(mesh: Mesh, noise: float = 0.5e-3, count: int = 12_000) -> PointCloud:
    rng = np.random.default_rng(1)
    points, _ = scatter(mesh, count, rng)
    return PointCloud(points + rng.normal(scale=noise, size=points.shape))


def box_mesh(extents: tuple[float, float, float]) -> Mesh:
    box = trimesh.creation.box(extents)
    return Mesh(np.asarray(box.vertices), np.asarray(box.faces))


@pytest.fixture(scope="module")
def half_ball() -> ObjectModel:
    return prepare_object(one_view(PARAMETRIC_OBJECTS["sphere"](), (0, 0, 1)))


def test_points_far_from_all_others_are_outliers():
    cloud = all_around(PARAMETRIC_OBJECTS["mug"]())
    strays = np.random.default_rng(0).uniform(-0.2, 0.2, (60, 3))
    strays = strays[np.abs(strays).max(axis=1) > 0.1]
    found = find_outliers(np.concatenate([cloud.points, strays]))
    assert found[len(cloud.points) :].mean() > 0.95
    assert found[: len(cloud.points)].mean() < 0.02


@pytest.mark.parametrize(
    ("name", "known"),
    [("sphere", True), ("bottle", True), ("l_bracket", True), ("mug", True), ("sphere", False), ("bottle", False)],
)
def test_normals_of_one_view_point_out(name, known):
    mesh = PARAMETRIC_OBJECTS[name]()
    cloud = one_view(mesh, FROM_ABOVE)
    oriented = orient_points(cloud if known else PointCloud(cloud.points))
    _, _, faces = mesh.trimesh.nearest.on_surface(oriented.points[::20])
    cosines = (oriented.normals[::20] * mesh.trimesh.face_normals[faces]).sum(axis=1)
    assert (cosines > 0).mean() > (0.95 if known else 0.9)
    assert np.median(cosines) > np.cos(np.radians(12))
    assert oriented.noise == pytest.approx(1e-3, rel=0.4)


@pytest.mark.parametrize("name", ["sphere", "bottle", "l_bracket"])
def test_cloud_from_all_around_is_the_object(exact_mesh, name):
    mesh = PARAMETRIC_OBJECTS[name]()
    model = prepare_object(all_around(mesh))
    assert model.mesh.watertight
    assert model.mesh.volume == pytest.approx(mesh.volume, rel=0.04)
    assert model.seen > 0.97
    assert (
        estimate_viewpoint(model.surface.grid.points, model.surface.normals, np.ones(len(model.surface.normals)))
        is None
    )
    distances = exact_mesh(mesh).distance(model.surface.grid.points[::100])
    assert np.percentile(distances, 95) < 1.2e-3


@pytest.mark.parametrize("name", ["sphere", "bottle", "l_bracket", "box"])
@pytest.mark.parametrize(("count", "noise"), [(400, 0.0), (1_000, 1e-3)])
def test_few_points_enclose_the_volume_of_the_object(name, count, noise):
    mesh = PARAMETRIC_OBJECTS[name]()
    closed = close_cloud(all_around(mesh, noise, count)).closed
    assert closed.volume == pytest.approx(mesh.volume, rel=0.04)


def test_clouds_that_leave_the_volume_open_are_said_to(barrett):
    wall = trimesh.creation.annulus(0.03, 0.0315, 0.09)
    points, _ = scatter(Mesh(np.asarray(wall.vertices), np.asarray(wall.faces)), 1_000, np.random.default_rng(1))
    points += np.random.default_rng(2).normal(scale=1e-3, size=points.shape)  # of its two sides, 1.5 mm apart
    model = prepare_object(PointCloud(points))

    assert model.seen < 0.75
    (remark,) = model.remarks
    assert f"{model.seen:.0%}" in remark
    assert "hollow may have been filled" in remark
    assert plan(model, barrett, starts=1).object.remarks == model.remarks
    assert prepare_object(all_around(PARAMETRIC_OBJECTS["sphere"](), count=1_000)).remarks == ()
    assert prepare_object(PARAMETRIC_OBJECTS["mug"]()).remarks == ()


def test_own_normals_are_believed():
    mesh = PARAMETRIC_OBJECTS["sphere"]()
    points, faces = scatter(mesh, 5_000, np.random.default_rng(0))
    normals = mesh.trimesh.face_normals[faces]
    bowl = points[:, 2] < 0  # seen from inside
    oriented = orient_points(PointCloud(points[bowl], -normals[bowl]))
    assert ((oriented.normals * oriented.points).sum(axis=1) < 0).all()


def test_own_normals_that_point_inwards_all_around_are_turned():
    mesh = PARAMETRIC_OBJECTS["sphere"]()
    points, faces = scatter(mesh, 5_000, np.random.default_rng(0))
    oriented = orient_points(PointCloud(points, -mesh.trimesh.face_normals[faces]))
    assert ((oriented.normals * oriented.points).sum(axis=1) > 0).all()


def test_contacts_are_on_the_seen_side_only(half_ball):
    samples, normals = half_ball.surface.grid.points, half_ball.surface.normals
    error = np.abs(np.linalg.norm(samples, axis=1) - RADIUS)
    assert np.percentile(error, 98) < 1.2e-3
    assert error.max() < 4e-3
    assert samples[:, 2].min() > -4e-3
    assert 0.4 < half_ball.seen < 0.7
    angles = np.arccos(np.clip((normals * samples).sum(axis=1) / np.linalg.norm(samples, axis=1), -1, 1))
    assert np.percentile(angles, 95) < np.radians(18)
    assert half_ball.to_document()["seen"] == half_ball.seen


def test_space_behind_the_seen_side_is_object(half_ball):
    behind = np.stack([np.zeros(20), np.zeros(20), np.linspace(0.02, -0.03, 20)], axis=1)
    assert all(rough_distance(half_ball.distance, tuple(point)) < 0 for point in behind)
    for point in ((0, 0, RADIUS + 0.01), (RADIUS + 0.01, 0, -0.01), (0, 0, -0.09)):
        assert rough_distance(half_ball.distance, point) > 0
    depths = half_ball.collision.points[:, 2]
    assert depths.min() == pytest.approx(-RADIUS, abs=6e-3)  # as deep as it is wide
    around = np.linalg.norm(half_ball.collision.points[:, :2], axis=1)
    assert around.max() < RADIUS + 5e-3
    assert ((depths < -0.01) & (around > 0.8 * RADIUS)).sum() > 100


def test_direction_of_the_view_is_found_from_the_normals(half_ball):
    model = prepare_object(PointCloud(one_view(PARAMETRIC_OBJECTS["sphere"](), (0, 0, 1)).points))
    assert model.seen == pytest.approx(half_ball.seen, abs=0.05)
    assert rough_distance(model.distance, (0.0, 0.0, -0.02)) < 0
    assert model.collision.points[:, 2].min() == pytest.approx(-RADIUS, abs=8e-3)


def test_same_cloud_gives_the_same_model(half_ball):
    cloud = one_view(PARAMETRIC_OBJECTS["sphere"](), (0, 0, 1))
    again = prepare_object(cloud)
    assert again.id == half_ball.id == cloud.content_hash
    for name, array in again.to_arrays().items():
        np.testing.assert_array_equal(array, half_ball.to_arrays()[name], err_msg=name)
    assert PointCloud(cloud.points).content_hash != cloud.content_hash


def test_outliers_and_mass_are_taken_care_of():
    cloud = one_view(PARAMETRIC_OBJECTS["bottle"](), FROM_ABOVE)
    strays = np.random.default_rng(2).uniform(-0.25, 0.25, (100, 3))
    model = prepare_object(
        PointCloud(np.concatenate([strays, cloud.points]), viewpoint=cloud.viewpoint), "b", ObjectOptions(mass=0.4)
    )
    assert model.mass == 0.4
    clean = prepare_object(cloud)
    np.testing.assert_allclose(model.mesh.bounds, clean.mesh.bounds, atol=0.01)


@pytest.mark.parametrize(
    ("points", "code"),
    [
        (np.random.default_rng(0).normal(size=(MIN_POINTS - 1, 3)), "too_few_points"),
        (np.random.default_rng(0).uniform(size=(500, 3)) * [0.1, 0.1, 0], "no_volume"),
    ],
)
def test_clouds_that_show_no_solid_are_refused(points, code):
    with pytest.raises(ObjectFileError) as refusal:
        prepare_object(PointCloud(points))
    assert refusal.value.code == code


@pytest.mark.parametrize("name", ["bottle", "mug"])
def test_one_noisy_view_plans_to_feasible_grasps_with_contacts_on_what_was_seen(barrett, exact_mesh, name):
    mesh = PARAMETRIC_OBJECTS[name]()
    cloud = one_view(mesh, (1.0, 0.3, 0.4))
    model = prepare_object(cloud, name)
    result = plan(model, barrett, starts=32)
    assert result.feasible > 0
    for grasp in result.grasps:
        if grasp.feasible:
            contacts = grasp.for_hand(barrett).contacts
            assert exact_mesh(mesh).distance(contacts).max() < 3e-3
            assert np.linalg.norm(cloud.points[:, None] - contacts, axis=2).min(axis=0).max() < 4e-3


@pytest.mark.campaign
def test_one_noisy_view_of_any_object_plans_to_feasible_grasps(every_object, barrett):
    feasible = [
        plan(prepare_object(one_view(every_object.mesh, towards)), barrett).feasible
        for towards in ((1.0, 0.3, 0.4), (0.0, -1.0, 0.5), (-0.4, 0.2, 1.0))
    ]
    assert sum(count > 0 for count in feasible) >= 2, feasible


@pytest.mark.parametrize("name", ["bunny_raw", "polygons"])
def test_meshes_with_holes_and_with_few_vertices_plan_to_feasible_grasps(objects_folder, prepared, barrett, name):
    if objects_folder is None:  # then a mug with a hole in its wall, and a box of twelve triangles
        mesh = prepared("mug").mesh if name == "bunny_raw" else prepared("box").mesh
        centers = mesh.vertices[mesh.faces].mean(axis=1)
        holed = np.linalg.norm(centers - centers[centers[:, 1].argmax()], axis=1) > 0.012
        mesh = Mesh(mesh.vertices, mesh.faces[holed])
    else:
        mesh, _ = read_file(objects_folder / f"{name}.ply")
    assert plan(prepare_object(mesh, name), barrett, starts=32).feasible > 0


@pytest.mark.parametrize("thickness", [0.002, 0.005, 0.01, 0.03])
def test_normals_of_thin_closed_plates_point_out_without_any_hint(thickness):
    plate = box_mesh((0.2, 0.15, thickness))
    points, faces = scatter(plate, 8_000, np.random.default_rng(3))
    oriented = orient_points(PointCloud(points))
    wanted = plate.trimesh.face_normals[faces][cKDTree(points).query(oriented.points)[1]]
    assert np.mean((oriented.normals * wanted).sum(axis=1) < 0) < 0.02
    assert estimate_viewpoint(oriented.points, oriented.normals, oriented.areas) is None


def test_walls_of_a_cup_face_outwards_and_inwards_without_any_hint():
    mug = PARAMETRIC_OBJECTS["mug"]()
    cloud = all_around(mug)
    assert close_cloud(cloud).closed.volume == pytest.approx(mug.volume, rel=0.1)


def test_normals_on_the_two_sides_of_a_thin_plate_are_believed():
    plate = box_mesh((0.2, 0.15, 0.002))
    points, faces = scatter(plate, 6_000, np.random.default_rng(3))
    normals = plate.trimesh.face_normals[faces]
    assert not contradict(points, normals)
    assert not contradict(points, -normals)
    assert contradict(points, normals * np.random.default_rng(0).choice([-1.0, 1.0], (len(points), 1)))


def test_sheets_and_single_views_are_open_and_bodies_are_closed():
    def openness(cloud: PointCloud) -> float:
        oriented = orient_points(cloud)
        return look_from_all_sides(*oriented).openness

    sheet = np.random.default_rng(0).uniform(-0.1, 0.1, (6_000, 3)) * [1, 1, 0] + [0, 0, 0.001]
    sheet[:, 2] += 0.2 * sheet[:, 0] ** 2
    assert openness(PointCloud(sheet)) > 0.8
    for name in ("sphere", "mug"):
        mesh = PARAMETRIC_OBJECTS[name]()
        assert openness(PointCloud(one_view(mesh, FROM_ABOVE, noise=2e-4).points)) > 0.3
        assert openness(all_around(mesh)) < 0.1
