"""Slack of the hand's links against MuJoCo's distances, dense points and finite differences."""

import math

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingersplit.hands.hand import load_hand
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.hands.shapes_kernel import shape_distance
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.scene import Approach, Constraints, Obstacle, Pose, Primitive, Retreat, Scene, SupportSurface
from fingersplit.scene.obstacles import new_slacks
from fingersplit.scene.obstacles_kernel import least_bound, measure_slacks, rough_violation
from fingersplit.scene.preparing import hand_reach, prepare_scene
from fingersplit.transforms import transform_points

HAND = load_hand("barrett")
FAR = 0.5
PLACED = Pose((0.3, -0.2, 0.5), (0.9, 0.1, -0.3, 0.2))
PRIMITIVES = {
    "box": Primitive.box(0.1, 0.06, 0.2),
    "sphere": Primitive.sphere(0.07),
    "cylinder": Primitive.cylinder(0.2, 0.05),
    "capsule": Primitive.capsule(0.1, 0.04),
}


@pytest.fixture(scope="module")
def model():
    return prepare_object(PARAMETRIC_OBJECTS["box"](), "box")


def scene_of(model, **entries):
    """Prepared scene whose ``clearance`` is zero unless given."""
    return prepare_scene(Constraints(Scene(**{"object_pose": PLACED, "clearance": 0.0, **entries})), model, HAND)


def random_pose(rng):
    joints = rng.uniform(HAND.lower, HAND.upper)
    object_from_palm = np.eye(4)
    object_from_palm[:3, :3] = Rotation.random(rng=rng).as_matrix()
    object_from_palm[:3, 3] = rng.normal(0, 0.15, 3)
    return HAND.pose(joints, object_from_palm)


def slacks(scene, pose, near=FAR):
    found, work = new_slacks()
    least = measure_slacks(scene.arrays, HAND.arrays, pose, found, work, near)
    values = found.slacks[: len(HAND.shape_names)].copy()
    assert least == values.min()
    return values, found


def mujoco_slacks(pose, primitive, world_from_obstacle):
    """Distance of every link from a primitive, by MuJoCo, in the scene's frame."""
    spec = mujoco.MjSpec()
    for k, link in enumerate(HAND.shape_poses(pose.joints[: len(HAND.joint_names)], palm(pose))):
        at = Pose.from_matrix(PLACED.matrix @ link)
        spec.worldbody.add_geom(
            type=HAND.arrays.shape_kinds[k], size=HAND.arrays.shape_sizes[k, :3], pos=at.position, quat=at.wxyz
        )
    at = Pose.from_matrix(world_from_obstacle)
    spec.worldbody.add_geom(**primitive.to_mujoco(), pos=at.position, quat=at.wxyz)
    compiled = spec.compile()
    compiled.opt.ccd_tolerance, compiled.opt.ccd_iterations = 1e-10, 500
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    last = len(HAND.shape_names)
    return np.array([mujoco.mj_geomDistance(compiled, data, k, last, 10.0, None) for k in range(last)])


def palm(pose):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.palm_rotation, pose.palm_position
    return matrix


@pytest.mark.parametrize("name", PRIMITIVES)
def test_slack_from_a_primitive_is_mujocos_distance(model, name):
    rng = np.random.default_rng(1)
    for _ in range(8):
        at = Pose(
            np.array([0.3, -0.2, 0.5]) + rng.normal(0, 0.1, 3), Rotation.random(rng=rng).as_quat(scalar_first=True)
        )
        scene = scene_of(model, obstacles=(Obstacle("it", at, PRIMITIVES[name]),))
        pose = random_pose(rng)
        values, _ = slacks(scene, pose)
        expected = mujoco_slacks(pose, PRIMITIVES[name], at.matrix)
        apart = expected > 1e-5
        np.testing.assert_allclose(values[apart & (expected < FAR)], expected[apart & (expected < FAR)], atol=5e-6)
        assert (values[expected < -1e-5] < 0).all()


def dense(pose):
    """Points on every link, scene frame, one array a link."""
    return [
        transform_points(PLACED.matrix @ link, mesh.sample(4000, seed=1))
        for link, mesh in zip(
            HAND.shape_poses(pose.joints[: len(HAND.joint_names)], palm(pose)), HAND.shape_meshes, strict=True
        )
    ]


def test_slack_from_supports_is_the_lowest_point(model):
    rng = np.random.default_rng(2)
    endless = SupportSurface("plane", (0.1, -0.2, 1.0), 0.4)
    scene = scene_of(model, support_surfaces=(endless,), clearance=0.003)
    for _ in range(8):
        pose = random_pose(rng)
        values, _ = slacks(scene, pose)
        lowest = np.array([(points @ endless.normal).min() - endless.offset for points in dense(pose)])
        np.testing.assert_allclose(values, lowest - 0.003, atol=1.5e-3)  # samples miss the very lowest point
        assert (values <= lowest - 0.003 + 1e-6).all()


def test_below_a_small_table_all_is_occupied(model):
    scene = scene_of(model, support_surfaces=(SupportSurface(offset=0.5, extents=(0.2, 0.2)),))
    table = Obstacle("same", Pose((0, 0, -0.5)), Primitive.box(0.2, 0.2, 2.0))
    rng = np.random.default_rng(3)
    for _ in range(5):
        pose = random_pose(rng)
        np.testing.assert_allclose(
            slacks(scene, pose)[0], slacks(scene_of(model, obstacles=(table,)), pose)[0], atol=1e-6
        )


def test_fingers_may_touch_a_support_that_allows_it(model):
    strict = scene_of(model, support_surfaces=(SupportSurface(offset=0.4),), clearance=0.004)
    allowing = scene_of(
        model, support_surfaces=(SupportSurface(offset=0.4, allow_finger_contact=True),), clearance=0.004
    )
    pose = random_pose(np.random.default_rng(4))
    gained = slacks(allowing, pose)[0] - slacks(strict, pose)[0]
    distal = (
        HAND.arrays.shape_links[: len(gained)] == HAND.arrays.joint_counts[HAND.arrays.shape_fingers[: len(gained)]] - 1
    )
    distal &= HAND.arrays.shape_fingers[: len(gained)] >= 0
    np.testing.assert_allclose(gained, np.where(distal, 0.004, 0.0), atol=1e-12)
    assert distal.sum() >= 3


def test_slack_from_a_cloud_is_that_of_its_nearest_point(model):
    rng = np.random.default_rng(5)
    points = rng.normal(0, 0.15, (3000, 3))
    scene = scene_of(model, obstacles=(Obstacle("cloud", PLACED, points=points, point_radius=0.002),), clearance=0.001)
    for _ in range(6):
        pose = random_pose(rng)
        values, found = slacks(scene, pose, near=0.05)
        links = HAND.shape_poses(pose.joints[: len(HAND.joint_names)], palm(pose))
        compiled = [nearest_point(k, link, points) - 0.003 for k, link in enumerate(links)]
        expected = np.where(np.array(compiled) < 0.05, compiled, math.inf)
        np.testing.assert_allclose(values, expected, atol=1e-9)
        assert (found.obstacles[: len(values)][values < 0.05] == 0).all()


def nearest_point(k, link, points):
    """Least distance of link ``k`` from any of the points."""
    kind, size = HAND.arrays.shape_kinds[k], HAND.arrays.shape_sizes[k]
    return min(shape_distance(kind, size, *local) for local in ((points - link[:3, 3]) @ link[:3, :3]).tolist())


def test_slack_falls_as_the_normals_say(model):
    """The slack's derivative by a motion of a link is minus the motion along its normal."""
    rng, step = np.random.default_rng(6), 1e-6
    scene = scene_of(
        model,
        support_surfaces=(SupportSurface(offset=0.45),),
        obstacles=(
            Obstacle("box", Pose((0.3, -0.2, 0.6)), Primitive.box(0.1, 0.06, 0.2)),
            Obstacle("cylinder", Pose((0.4, -0.2, 0.5)), Primitive.cylinder(0.1, 0.06)),
            Obstacle("cloud", PLACED, points=rng.normal(0, 0.15, (500, 3))),
        ),
    )
    checked = 0
    for _ in range(10):
        pose = random_pose(rng)
        values, found = slacks(scene, pose)
        normals = found.normals[: len(values)].copy()
        for axis in range(3):
            pose.palm_position[axis] += step
            move_fingers(HAND.arrays, pose)
            slope = (slacks(scene, pose)[0] - values) / step
            pose.palm_position[axis] -= step
            clear = values > 1e-3
            np.testing.assert_allclose(slope[clear], -normals[clear, axis], atol=2e-2)
            checked += clear.sum()
    assert checked > 100


def test_rough_violation_is_near_the_exact_one(model):
    rng = np.random.default_rng(7)
    scene = scene_of(model, support_surfaces=(SupportSurface(offset=0.4),), clearance=0.002)
    for _ in range(20):
        pose = random_pose(rng)
        exact = max(-slacks(scene, pose)[0].min(), 0.0)
        rough = rough_violation(scene.arrays, HAND.arrays, pose, new_slacks()[1], np.inf)
        assert rough <= exact + 1e-9
        assert rough >= exact - 0.02


def test_what_is_out_of_reach_is_left_out(model):
    away = 2 * hand_reach(HAND) + 0.5 * float(np.linalg.norm(model.mesh.extents)) + 0.1
    far = (PLACED.position[0] + away + 0.2, *PLACED.position[1:])
    cloud = np.random.default_rng(8).normal(0, 1e-3, (10, 3))
    scene = scene_of(
        model,
        obstacles=(Obstacle("ball", Pose(far), Primitive.sphere(0.01)), Obstacle("cloud", Pose(far), points=cloud)),
    )
    assert scene.arrays is None
    long = Constraints(
        Scene(object_pose=PLACED, obstacles=(Obstacle("ball", Pose(far), Primitive.sphere(0.01)),)),
        Approach(desired_distance=0.4, retreat=Retreat(desired_distance=0.4)),
    )
    assert prepare_scene(long, model, HAND).arrays is not None


def test_a_mesh_is_met_where_it_stands(model):
    other = prepare_object(PARAMETRIC_OBJECTS["box"](), "other")
    at = Pose((0.35, -0.2, 0.5), (1, 0, 0, 1))
    scene = scene_of(model, obstacles=(Obstacle("box", at, model=other),))
    (mesh,) = scene.meshes
    np.testing.assert_allclose(PLACED.matrix @ np.linalg.inv(mesh.obstacle_from_object), at.matrix, atol=1e-12)
    low, high = other.mesh.bounds
    same = Obstacle(
        "box", Pose.from_matrix(at.matrix @ Pose(tuple((low + high) / 2)).matrix), Primitive.box(*(high - low))
    )
    for seed in range(6):
        pose = random_pose(np.random.default_rng(seed))
        points, exact = slacks(scene, pose, 0.05)[0], slacks(scene_of(model, obstacles=(same,)), pose, 0.05)[0]
        outside = (exact > 0.002) & (exact < 0.045)
        np.testing.assert_allclose(points[outside], exact[outside], atol=2e-3)


def test_an_object_in_its_support_is_told(model):
    low = model.mesh.bounds[0, 2]
    sunk = Scene(object_pose=Pose((0, 0, -low - 0.02)), support_surfaces=(SupportSurface(),))
    (warning,) = prepare_scene(Constraints(sunk), model, HAND).warnings
    assert "20 mm below support surface 'table'" in warning
    assert prepare_scene(Constraints(Scene(support_surfaces=(SupportSurface(),))), model, HAND).warnings == ()


def test_points_are_no_nearer_than_their_bounds(model):
    rng = np.random.default_rng(11)
    points = np.concatenate([rng.normal(0, 0.05, (200, 3)), rng.uniform(-0.1, 0.1, (3000, 3)) * [1, 1, 0.01]])
    arrays = scene_of(model, object_pose=Pose(), obstacles=(Obstacle("cloud", points=points),)).arrays
    for place in rng.normal(0, 0.15, (2000, 3)):
        distance = np.linalg.norm(points - place, axis=1).min()
        assert least_bound(arrays, tuple(place)) <= distance


def test_what_lacks_enough_is_not_searched_further(model):
    rng = np.random.default_rng(12)
    scene = scene_of(
        model, support_surfaces=(SupportSurface(offset=0.45),), obstacles=(Obstacle("it", PLACED, PRIMITIVES["box"]),)
    )
    for _ in range(20):
        pose, work = random_pose(rng), new_slacks()[1]
        whole = rough_violation(scene.arrays, HAND.arrays, pose, work, np.inf)
        part = rough_violation(scene.arrays, HAND.arrays, pose, work, 0.01)
        assert part == whole or 0.01 <= part <= whole
