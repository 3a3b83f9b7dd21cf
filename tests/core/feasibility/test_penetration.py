"""Depth of the triangles in the links: against a search over all of them, and against dense points on every object."""

import numpy as np
import pytest

from fingersplit.feasibility.penetration_kernel import ACCURACY, exact_penetration
from fingersplit.objects.scatter import scatter
from fingersplit.planning.search import find_grasps
from fingersplit.splitting.collision_kernel import measure_clearances
from fingersplit.transforms import pose_matrix, wxyz_from_rotation

NOTHING_LESS = 0.0
TOLERANCE = 1e-3  # of the default settings


@pytest.fixture(scope="module")
def near_grasps(barrett, mujoco_barrett, prepared, posed_state):
    """Models, hands a few millimetres beside finished grasps, and how deep the triangles are in them [m]."""
    found = []
    for name in ("mug", "l_bracket"):
        model, rng = prepared(name), np.random.default_rng(0)
        triangles = model.mesh.vertices[model.mesh.faces]
        for run in find_grasps(model, barrett, starts=16, seed=4).runs:
            object_from_palm = run.final.object_from_palm.copy()
            object_from_palm[:3, 3] += rng.uniform(-2e-3, 2e-3, 3)
            joints = dict(zip(barrett.joint_names, run.final.joints, strict=True))
            mujoco_barrett.move(joints, wxyz_from_rotation(object_from_palm[:3, :3]), object_from_palm[:3, 3])
            depth = mujoco_barrett.depth_of_triangles(triangles)
            found.append((model, posed_state(run.final.joints, object_from_palm), depth))
    return found


def test_depth_is_that_of_the_triangles(barrett, near_grasps):
    sample_misses, misses = [], []
    for model, state, depth in near_grasps:
        exact = exact_penetration(barrett.arrays, state, model.patches, model.distance, NOTHING_LESS)
        misses.append(depth - exact)
        measure_clearances(barrett.arrays, state, model.surface.grid, model.distance, np.empty((3, 3)))
        sample_misses.append(depth - state.penetration)
    assert np.mean([depth > 0.5e-3 for _, _, depth in near_grasps]) > 0.3
    assert max(sample_misses) > 0.05e-3  # or there would be no need of triangles
    assert max(misses) < ACCURACY + 1e-6  # the search over all triangles is right to a micrometre
    assert min(misses) > -1e-6


def test_what_is_not_deeper_than_asked_for_is_told_by_the_samples(barrett, near_grasps):
    beyond = 0
    for model, state, depth in near_grasps:
        measure_clearances(barrett.arrays, state, model.surface.grid, model.distance, np.empty((3, 3)))
        found = exact_penetration(barrett.arrays, state, model.patches, model.distance, TOLERANCE)
        if depth > TOLERANCE + ACCURACY:
            beyond += 1
            assert found == pytest.approx(depth, abs=ACCURACY + 1e-6)
        else:
            assert found == pytest.approx(state.penetration, abs=1e-12)
    assert 5 < beyond < len(near_grasps) - 5


def test_hand_far_away_is_in_nothing(barrett, prepared, posed_state):
    model, state = prepared("mug"), posed_state(barrett.lower, pose_matrix(np.eye(3), (0, 0, 1.0)))
    assert exact_penetration(barrett.arrays, state, model.patches, model.distance, NOTHING_LESS) == 0


@pytest.mark.campaign
def test_no_feasible_run_lies_deeper_than_allowed(every_object, barrett, mujoco_barrett):
    """Of all runs, not only of those that are returned; the exact search, which is slow, is for three of them."""
    points, _ = scatter(every_object.mesh, 100_000, np.random.default_rng(5))
    triangles, deepest, looked_at = every_object.mesh.vertices[every_object.mesh.faces], 0.0, 0
    for run in find_grasps(every_object, barrett, starts=32, seed=7).runs:
        if run.feasible:
            palm = run.final.object_from_palm
            joints = dict(zip(barrett.joint_names, run.final.joints, strict=True))
            mujoco_barrett.move(joints, wxyz_from_rotation(palm[:3, :3]), palm[:3, 3])
            deepest = max(deepest, mujoco_barrett.depth(points))
            if looked_at < 3:
                deepest = max(deepest, mujoco_barrett.depth_of_triangles(triangles))
            looked_at += 1
    assert looked_at > 0
    assert deepest < TOLERANCE + ACCURACY + 1e-6
