"""Plans with a scene: no answer breaks a constraint, by measures that the search has no part in."""

from functools import cache

import numpy as np
import pytest

from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.relaxing import count_obstacles
from fingersplit.planning.search import find_grasps
from fingersplit.scene import (
    Approach,
    ApproachCone,
    AttachedBody,
    Constraints,
    ContactRegions,
    EndEffector,
    Obstacle,
    Pose,
    Primitive,
    Reach,
    Region,
    Scene,
    SupportSurface,
    Workspace,
)
from fingersplit.scene.preparing import prepare_scene
from fingersplit.splitting.termination import Termination
from fingersplit.transforms import transform_points

HAND = load_hand("barrett")
TABLE = SupportSurface()


@cache
def model(name):
    return prepare_object(PARAMETRIC_OBJECTS[name](), name)


@cache
def table_scene(name):
    """Object pose on a table."""
    return prepare_scene(Constraints(Scene(support_surfaces=(TABLE,))), model(name), HAND).constraints.scene


def feasible(name, constraints, starts=24):
    return [run for run in find_grasps(model(name), HAND, starts=starts, constraints=constraints).runs if run.feasible]


@cache
def link_points():
    return [mesh.sample(1500, seed=1) for mesh in HAND.shape_meshes]


def hand_points(run, joints, world_from_palm):
    """Points on all links, scene frame (n, 3) [m]."""
    links = HAND.shape_poses(joints, world_from_palm)
    return np.concatenate([transform_points(link, points) for link, points in zip(links, link_points(), strict=True)])


def way(run, world_from_object, steps=60):
    """Hand postures from the pre-grasp to the grasp: joints and world_from_palm."""
    record, final = run.outcome.way, run.final
    opened = record.joints[: len(HAND.joint_names)]
    for back in np.linspace(record.distance, 0.0, steps):
        pose = final.object_from_palm.copy()
        pose[:3, 3] -= back * record.direction
        yield opened, world_from_object @ pose
    for share in np.linspace(0.0, 1.0, 12):
        yield opened + share * (final.joints - opened), world_from_object @ final.object_from_palm


def outcome(run):
    """What came of a run, bit for bit."""
    arrays = (run.final.object_from_palm, run.final.joints, run.final.contacts, run.outcome.way.joints)
    return (int(run.outcome.violations), *(array.tobytes() for array in arrays))


def box_distance(points, center, extents):
    offsets = np.abs(points - center) - np.array(extents) / 2
    return np.linalg.norm(np.maximum(offsets, 0), axis=1) + np.minimum(offsets.max(axis=1), 0)


@pytest.mark.parametrize("name", ["box", "cylinder", "mug", "l_bracket"])
def test_hands_keep_clear_of_the_table_on_all_their_way(name):
    scene = table_scene(name)
    runs = feasible(name, Constraints(scene))
    assert runs
    for run in runs:
        for joints, pose in way(run, scene.world_from_object):
            assert hand_points(run, joints, pose)[:, 2].min() > scene.clearance - 0.6e-3  # between two steps of a sweep
        final = hand_points(run, run.final.joints, scene.world_from_object @ run.final.object_from_palm)
        assert final[:, 2].min() > scene.clearance - 2e-5


def test_without_the_table_hands_go_through_it():
    scene = table_scene("cylinder")
    through = [
        hand_points(run, run.final.joints, scene.world_from_object @ run.final.object_from_palm)[:, 2].min() < 0
        for run in feasible("cylinder", None)
    ]
    assert np.mean(through) > 0.3


def test_obstacles_of_all_kinds_are_kept_clear_of():
    scene, name = table_scene("box"), "box"
    middle = transform_points(scene.world_from_object, model(name).mesh.bounds.mean(axis=0))
    wall = middle + np.array([0.09, 0, 0.05])
    ball = prepare_object(PARAMETRIC_OBJECTS["sphere"](), "sphere")
    radius = ball.mesh.extents[0] / 2
    beside = middle + np.array([0, 0.05 + radius + model(name).mesh.extents.max() / 2, 0])
    grid = np.stack(np.meshgrid(np.linspace(-0.2, 0.2, 60), np.linspace(0, 0.2, 60)), axis=-1).reshape(-1, 2)
    cloud = np.column_stack([np.full(len(grid), middle[0] - 0.1), grid])
    around = Scene(
        object_pose=scene.object_pose,
        support_surfaces=(TABLE,),
        obstacles=(
            Obstacle("wall", Pose(tuple(wall)), Primitive.box(0.02, 0.4, 0.3)),
            Obstacle("ball", Pose(tuple(beside)), model=ball),
            Obstacle("cloud", points=cloud, point_radius=0.003),
        ),
    )
    runs = feasible(name, Constraints(around), 48)
    assert runs
    for run in runs:
        points = hand_points(run, run.final.joints, scene.world_from_object @ run.final.object_from_palm)
        least = scene.clearance - 0.2e-3
        assert box_distance(points, wall, (0.02, 0.4, 0.3)).min() > least
        assert np.linalg.norm(points - beside, axis=1).min() - radius > least - 0.3e-3  # the ball has facets
        # The links as points are farther from the cloud's than the links themselves.
        nearest = min(np.linalg.norm(cloud - point, axis=1).min() for point in points[:: len(points) // 500])
        assert nearest > scene.clearance + 0.003 - 0.2e-3


@pytest.mark.parametrize("axis", [(0, 0, -1), (0, 0, 1), (1, 0, 0)])
def test_ways_in_lie_in_a_cone(axis):
    cone = ApproachCone(axis, 0.4)
    runs = feasible("mug", Constraints(approach=Approach(directions=(cone,))))
    assert runs
    for run in runs:
        assert run.outcome.way.direction @ np.array(axis) >= np.cos(0.4) - 1e-6
        assert run.outcome.way.distance >= 0.03


def test_palms_stay_in_the_workspace_and_in_reach():
    low = Workspace((-0.5, -0.5, -0.5), (0.5, 0.5, 0.02))
    for run in feasible("mug", Constraints(Scene(workspace=low))):
        start = run.final.object_from_palm[:3, 3] - run.outcome.way.distance * run.outcome.way.direction
        assert max(run.final.object_from_palm[2, 3], start[2]) <= 0.02 + 1e-6
    reach = Reach((0.5, 0, 0), 0.1, 0.5)
    runs = feasible("mug", Constraints(end_effector=EndEffector(reach=reach)))
    assert runs
    for run in runs:
        assert np.linalg.norm(run.final.object_from_palm[:3, 3] - [0.5, 0, 0]) <= 0.5 + 1e-6


def test_contacts_stay_in_their_regions():
    middle = float(model("bottle").mesh.bounds[:, 2].mean())
    upper = Region("half_space", normal=(0, 0, -1), offset=-middle)
    tip = Region("sphere", Pose((0, 0, float(model("bottle").mesh.bounds[1, 2]))), radius=0.03)
    runs = feasible("bottle", Constraints(contact_regions=ContactRegions((upper,), (tip,))))
    assert runs
    for run in runs:
        assert (run.final.contacts[:, 2] >= middle).all()
        assert (np.linalg.norm(run.final.contacts - tip.pose.position, axis=1) > 0.03).all()


def test_attached_bodies_keep_clear_of_everything():
    scene = table_scene("box")
    size = (0.03, 0.03, 0.12)
    camera = AttachedBody(Primitive.box(*size), Pose((0.08, 0, 0)))
    runs = feasible("box", Constraints(scene, end_effector=EndEffector(attached_bodies=(camera,))))
    assert runs
    corners = (np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T * size) + camera.pose.position
    for run in runs:
        world_from_palm = scene.world_from_object @ run.final.object_from_palm
        assert transform_points(world_from_palm, corners)[:, 2].min() > scene.clearance - 2e-5
        palm_from_object = np.linalg.inv(run.final.object_from_palm)
        object_in_camera = transform_points(palm_from_object, model("box").mesh.vertices) - camera.pose.position
        assert not (np.abs(object_in_camera) < np.array(size) / 2 - 1e-3).all(axis=1).any()


def test_a_way_in_is_required_unless_a_request_says_otherwise():
    everywhere = Constraints(approach=Approach(required=False))
    free, all_ends = feasible("l_bracket", None, 48), feasible("l_bracket", everywhere, 48)
    assert len(all_ends) > len(free)
    assert all(run.outcome.way.distance >= 0.03 for run in free)
    assert any(run.outcome.way.distance < 0.03 for run in all_ends)


def test_what_forbids_everything_is_told():
    closed = Scene(object_pose=Pose(), obstacles=(Obstacle("block", Pose(), Primitive.box(1, 1, 1)),))
    found = find_grasps(model("box"), HAND, starts=8, constraints=Constraints(closed))
    assert found.feasible == 0
    assert found.message
    none = ContactRegions(forbidden=(Region("sphere", radius=10.0),))
    found = find_grasps(model("box"), HAND, starts=8, constraints=Constraints(contact_regions=none))
    assert found.feasible == 0


def test_a_plan_with_a_scene_comes_out_again():
    constraints = Constraints(table_scene("mug"))
    first, again = (find_grasps(model("mug"), HAND, starts=16, constraints=constraints, threads=t) for t in (1, 2))
    assert list(map(outcome, first.runs)) == list(map(outcome, again.runs))


def test_a_scene_that_is_out_of_reach_changes_nothing():
    far = Scene(object_pose=Pose(), obstacles=(Obstacle("far", Pose((5, 5, 5)), Primitive.sphere(0.1)),))
    first, again = (find_grasps(model("mug"), HAND, starts=16, constraints=c) for c in (None, Constraints(far)))
    assert list(map(outcome, first.runs)) == list(map(outcome, again.runs))


@pytest.mark.parametrize("name", ["box", "mug", "bottle"])
def test_relaxing_a_constraint_loses_no_only_grasp(name):
    scene = table_scene(name)
    for angle in (0.2, 0.5, 1.0, 3.1):
        cone = Approach(directions=(ApproachCone((0, 0, -1), angle),))
        found = [
            bool(feasible(name, Constraints(Scene(**{**vars(scene), "clearance": clearance}), cone), 16))
            for clearance in (0.02, 0.005, 0.0)
        ]
        assert found == sorted(found)
        if angle == 0.2:
            narrow = found
        assert found[-1] >= narrow[-1]


def test_blocked_ways_name_what_blocks_them():
    scene = table_scene("mug")
    runs = find_grasps(model("mug"), HAND, starts=48, constraints=Constraints(scene)).runs
    sentences = [" ".join(run.violations) for run in runs if run.termination == Termination.NO_FREE_APPROACH]
    assert any("'table'" in sentence for sentence in sentences)


def test_the_constraint_in_the_way_is_named():
    far = Constraints(Scene(workspace=Workspace((1.0, 1.0, 1.0), (1.2, 1.2, 1.2))))
    found = find_grasps(model("box"), HAND, starts=8, constraints=far)
    assert found.feasible == 0
    (relaxation,) = found.relaxations
    assert relaxation.constraint == "scene.workspace"
    assert relaxation.amount is not None
    assert 0.7 < relaxation.amount < 1.3  # the palm is within some 30 cm of the object's origin
    assert relaxation.sentence in found.message


def test_obstacles_tell_what_they_rejected():
    scene = table_scene("mug")
    found = find_grasps(model("mug"), HAND, starts=24, constraints=Constraints(scene))
    counted = count_obstacles(found.runs, found.scene)
    assert counted["table"] == sum("'table'" in " ".join(run.violations) for run in found.runs) > 0


def test_an_approach_that_begins_a_rounding_error_into_a_wall_is_measured_to_its_end():
    """Of walls that move towards where the approach begins, the last that leaves it free reaches into the hand."""
    found = find_grasps(model("cylinder"), HAND, starts=16, seed=3)
    run = next(one.run for one in found.grasps if one.run.feasible and one.execution.pregrasp_pose is not None)
    execution = next(one.execution for one in found.grasps if one.run is run)
    backwards = execution.pregrasp_pose[:3, 3] - run.final.object_from_palm[:3, 3]
    backwards /= np.linalg.norm(backwards)
    cone = ApproachCone(tuple((-backwards).tolist()), max_angle=0.01)
    farthest = float((hand_points(run, execution.pregrasp_joints, execution.pregrasp_pose) @ backwards).max())
    turned = np.linalg.qr(np.column_stack([backwards, np.eye(3)[:, np.argsort(np.abs(backwards))[:2]]]))[0]
    turned *= np.sign(np.linalg.det(turned))
    turned[:, 0] = backwards
    turned[:, 2] = np.cross(turned[:, 0], turned[:, 1])

    def reached(offset):
        """Length of the approach before a wall that begins ``offset`` behind the points of the hand [m]."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = turned, (farthest + offset + 0.05) * backwards
        wall = Obstacle("wall", Pose.from_matrix(pose), Primitive.box(0.1, 2.0, 2.0))
        approach = Approach((cone,), min_distance=0.01, desired_distance=0.1)
        scene = Constraints(Scene(object_pose=Pose(), obstacles=(wall,)), approach=approach)
        again = find_grasps(model("cylinder"), HAND, [run.parallel_grasp], seed=3, constraints=scene).runs
        return max((float(one.outcome.way.distance) for one in again), default=0.0)

    blocked, free = -0.02, 0.02
    for _ in range(24):
        middle = (blocked + free) / 2
        blocked, free = (blocked, middle) if reached(middle) >= 0.1 - 1e-12 else (middle, free)
    assert -0.02 < blocked < free < 0.02
    assert reached(free) == pytest.approx(0.1)
    assert 0.0 < reached(blocked) < 0.1
