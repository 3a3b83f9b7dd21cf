"""The sections `depth`, `generated_scenes` and `dense_grasps` on one small object, and what the dense checks see."""

from dataclasses import replace

import numpy as np
import pytest

from fingersplit.objects.parametric import cylinder
from fingersplit.planning.search import find_grasps
from fingersplit.scene import Constraints, Obstacle, Pose, Primitive, Scene, SupportSurface
from fingersplit_bench.dense_check import measure_excess
from fingersplit_bench.dense_grasps import DenseObject, dense_grasps_chapter, measure_grasp
from fingersplit_bench.depth import depth_chapter
from fingersplit_bench.generated_scenes import generated_scenes_chapter
from fingersplit_bench.suite import Bench


@pytest.fixture(scope="module")
def bench(barrett, tmp_path_factory):
    return Bench(
        {"can": lambda: cylinder(0.03, 0.1)}, barrett, tmp_path_factory.mktemp("report"), 1, 16, lambda _: None
    )


def test_a_rendered_view_leads_to_a_grasp_that_is_tried_on_the_true_mesh(bench):
    chapter = depth_chapter(bench)

    (one,) = chapter.data["objects"]
    assert one["pick"] == "held"
    assert one["points"] > 500
    assert 0.3 < one["assumed"] < 0.8
    assert min(one["cut_ms"], one["prepare_ms"], one["plan_ms"]) > 0
    assert "1 of 1 held" in chapter.text


def test_generated_scenes_are_planned_in_and_checked(bench):
    chapter = generated_scenes_chapter(bench)

    (one,) = chapter.data["objects"]
    assert one["scenes"] == 2
    assert one["solved"] == one["solvable"] > 0
    assert one["grasps"] > 0
    assert one["violating"] == 0
    assert f"0 of {one['grasps']}" in chapter.text


def test_the_dense_check_sees_what_comes_too_near(bench):
    constraints = Constraints(Scene(support_surfaces=(SupportSurface(),)))
    found = find_grasps(bench.model("can"), bench.hand, starts=8, seed=1, constraints=constraints)
    run = found.grasps[0].run
    assert measure_excess(run, bench.hand).most < 1e-4

    def excess(**entries):
        scene = replace(run.scene.constraints.scene, **entries)
        changed = replace(run.scene, constraints=replace(run.scene.constraints, scene=scene))
        return measure_excess(replace(run, scene=changed), bench.hand)

    palm = (run.scene.world_from_object @ run.final.object_from_palm)[:3, 3]
    ball = Obstacle("ball", Pose(tuple(palm)), Primitive.sphere(0.02))
    dust = Obstacle("dust", points=np.array([palm]), point_radius=0.02)
    assert excess(obstacles=(ball,)).obstacle > 0.01
    assert excess(obstacles=(dust,)).obstacle > -0.03
    assert excess(support_surfaces=(SupportSurface(offset=0.05),)).support > 0.01


def test_feasible_grasps_keep_their_depths_and_pad_angles(bench):
    chapter = dense_grasps_chapter(bench)

    (one,) = chapter.data["objects"]
    assert one["grasps"] > 0
    assert one["in_object"] == one["in_links"] == one["tilted"] == 0
    assert 0.1 < one["pad_angle"] <= 0.6 + 1e-3
    assert f"Of {one['grasps']} feasible grasps" in chapter.text


def test_the_check_of_grasps_sees_depth_and_tilted_pads(bench):
    model = bench.model("can")
    dense, grasps = DenseObject(model), find_grasps(model, bench.hand, starts=8, seed=1).grasps
    run = next(one.run for one in grasps if one.run.feasible)
    depth, links, _ = measure_grasp(run, bench.hand, dense)
    moved = run.last.copy()
    moved.palm_position -= 0.004 * run.final.normals[0]  # the first finger goes into the object, others off it
    changed = replace(run, last=moved)
    deeper = measure_grasp(changed, bench.hand, dense)
    assert depth < 1e-3 < deeper[0]
    assert links < 1e-3
    folded = run.last.copy()
    folded.joints[: len(bench.hand.joint_names)] = bench.hand.upper
    assert measure_grasp(replace(run, last=folded), bench.hand, dense)[2] > 0.65
