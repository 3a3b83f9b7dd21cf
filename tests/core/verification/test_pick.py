"""Whole picks: what holds, and what each way to fail is called."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fingersplit.errors import SettingsError
from fingersplit.hands.hand import load_hand
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan as plan_result
from fingersplit.planning.search import find_grasps
from fingersplit.result import PlanResult
from fingersplit.scene import AttachedBody, Constraints, EndEffector, Obstacle, Pose, Primitive, Scene, SupportSurface
from fingersplit.scene.preparing import prepare_scene
from fingersplit.verification import verify_ranked
from fingersplit.verification.pick import verify_pick
from fingersplit.verification.picking import PickWays
from fingersplit.verification.protocols import load_protocol

HAND = load_hand("barrett")


@cache
def planned():
    """A box on a table, its convex pieces, and the best grasp."""
    model = prepare_object(PARAMETRIC_OBJECTS["box"](), "box")
    constraints = Constraints(Scene(support_surfaces=(SupportSurface(),)))
    found = find_grasps(model, HAND, starts=24, constraints=constraints)
    return model, decompose(model.mesh), found.grasps[0]


def picked(scene=None, **options):
    model, pieces, best = planned()
    execution = best.execution
    ways = PickWays(
        approach=execution.approach_direction,
        approach_distance=execution.approach_distance,
        opened=execution.pregrasp_joints,
        retreat=execution.retreat_direction,
        retreat_distance=execution.retreat_distance,
    )
    return verify_pick(best.run.final, HAND, model, pieces, scene or best.run.scene, ways, **options)


def scene_with(**entries):
    """The planned scene with other entries."""
    model, _, best = planned()
    return prepare_scene(Constraints(replace(best.run.scene.constraints.scene, **entries)), model, HAND)


def test_a_planned_grasp_picks_its_object():
    report = picked()
    assert report.reason == "held"
    assert report.touched == ()
    assert report.lost_contacts == ()
    assert report.settling < 2e-3
    assert report.pushed < 3e-3
    assert report.lifted == pytest.approx(planned()[2].execution.retreat_distance, abs=5e-3)
    assert all(touch is not None and touch > 1.0 for touch in report.first_touches)  # none during the approach
    raised = report.object_positions[-1] - report.object_positions[0]
    assert raised[2] > 0.09
    assert len(report.times) == len(report.joints) == len(report.palm_positions)


def test_the_same_pick_comes_out_again():
    first, again = picked(), picked()
    np.testing.assert_array_equal(first.object_positions, again.object_positions)


def test_an_obstacle_in_the_way_is_named():
    execution, world = planned()[2].execution, planned()[2].run.scene.world_from_object
    start = (world @ execution.pregrasp_pose)[:3, 3]
    report = picked(scene_with(obstacles=(Obstacle("ball", Pose(tuple(start)), Primitive.sphere(0.02)),)))
    assert report.reason == "obstacle_touched"
    assert report.touched == ("ball",)


def test_a_slippery_object_is_not_held():
    report = picked(friction=0.02)
    assert report.reason in ("slipped", "rotated", "contact_lost")
    assert report.reason != "held"


def test_an_object_that_falls_does_not_rest():
    pose = planned()[2].run.scene.world_from_object.copy()
    pose[2, 3] += 0.05
    report = picked(scene_with(object_pose=Pose.from_matrix(pose)))
    assert report.reason == "not_at_rest"
    assert report.settling > 0.02


def test_a_scene_without_a_support_is_refused():
    with pytest.raises(SettingsError, match="support surface"):
        picked(scene_with(support_surfaces=()))


def test_ranked_grasps_are_picked_until_enough_hold():
    model, pieces, _ = planned()
    constraints = Constraints(Scene(support_surfaces=(SupportSurface(),)))
    result = PlanResult.from_dict(plan_result(model, HAND, starts=24, constraints=constraints).to_dict())
    verified = verify_ranked(result, model, HAND, pieces, verified=1, protocol="pick")
    report = verified.grasps[0].verification
    assert report is not None
    assert report.passed
    assert report.settings["pick"]["touched"] == []
    assert set(report.settings["pick"]["first_touches"]) == {finger.name for finger in HAND.fingers}
    assert verified.summary.verification is not None
    assert verified.summary.verification.held == 1
    assert PlanResult.from_dict(verified.to_dict()).to_dict() == verified.to_dict()


def test_noisy_picks_pass_by_the_share_that_holds():
    model, pieces, _ = planned()
    constraints = Constraints(Scene(support_surfaces=(SupportSurface(),)))
    result = plan_result(model, HAND, starts=24, top_k=1, constraints=constraints)

    def picked_with(**values):
        protocol = load_protocol("noisy_pick", {"draws": 3} | values)
        return verify_ranked(result, model, HAND, pieces, verified=1, protocol=protocol).grasps[0].verification

    still, wild = picked_with(position_noise=0.0, rotation_noise=0.0), picked_with(position_noise=0.08)
    assert still.passed
    assert [trial.name for trial in still.trials] == ["draw 1", "draw 2", "draw 3"]
    assert not wild.passed
    assert wild.reason in {trial.reason for trial in wild.trials}
    assert picked_with(position_noise=0.08, least_share=0.0).passed


def test_what_is_attached_to_the_palm_is_there_in_the_world():
    execution, scene = planned()[2].execution, planned()[2].run.scene
    beside = Pose((0.0, 0.25, -0.05))  # beyond all links
    camera = AttachedBody(Primitive.sphere(0.03), beside)
    hit = (scene.world_from_object @ execution.pregrasp_pose @ beside.matrix)[:3, 3]
    post = Obstacle("post", Pose(tuple(hit)), Primitive.sphere(0.01))

    def with_bodies(*bodies):
        entries = replace(scene.constraints.scene, obstacles=(post,))
        constraints = Constraints(entries, end_effector=EndEffector(attached_bodies=bodies))
        return picked(prepare_scene(constraints, planned()[0], HAND))

    assert with_bodies().reason == "held"
    report = with_bodies(camera)
    assert report.reason == "obstacle_touched"
    assert report.touched == ("post",)
