"""Penetration of surface points into links against a loop over MuJoCo's geoms."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.planning import plan
from fingersplit.splitting.collision import penetration, refined_penetration
from fingersplit.transforms import pose_matrix, wxyz_from_rotation


@given(seed=st.integers(0, 2**32 - 1))
def test_deepest_point_is_found(barrett, mujoco_barrett, prepared, seed):
    rng = np.random.default_rng(seed)
    grid = prepared("mug").collision
    joints = rng.uniform(barrett.lower, barrett.upper)
    rotation, position = Rotation.random(rng=rng).as_matrix(), rng.uniform(-0.15, 0.15, 3)
    mujoco_barrett.move(dict(zip(barrett.joint_names, joints, strict=True)), wxyz_from_rotation(rotation), position)
    found = penetration(barrett.arrays, barrett.pose(joints, pose_matrix(rotation, position)), grid)
    assert found == pytest.approx(mujoco_barrett.depth(grid.points), abs=1e-12)


def test_hand_far_away_touches_nothing(barrett, prepared):
    pose = barrett.pose(barrett.lower, pose_matrix(np.eye(3), (0, 0, 1.0)))
    assert penetration(barrett.arrays, pose, prepared("mug").collision) == 0


def test_refinement_finds_what_lies_between_the_samples(barrett, mujoco_barrett, prepared):
    model, rng = prepared("mug"), np.random.default_rng(0)
    dense, _ = trimesh.sample.sample_surface(model.mesh.trimesh, 100_000, seed=np.random.default_rng(7))
    sparse_misses, refined_misses = [], []
    for run in plan(model, barrett, starts=24, seed=4).runs:
        object_from_palm = run.final.object_from_palm.copy()
        object_from_palm[:3, 3] += rng.uniform(-2e-3, 2e-3, 3)
        pose = barrett.pose(run.final.joints, object_from_palm)
        wxyz = wxyz_from_rotation(object_from_palm[:3, :3])
        mujoco_barrett.move(
            dict(zip(barrett.joint_names, run.final.joints, strict=True)), wxyz, object_from_palm[:3, 3]
        )
        depth = mujoco_barrett.depth(dense)
        if depth > 0.5e-3:
            sparse_misses.append(depth - penetration(barrett.arrays, pose, model.surface.grid))
            refined_misses.append(depth - refined_penetration(barrett.arrays, pose, model.surface))
    assert len(refined_misses) > 12
    assert max(sparse_misses) > 0.05e-3  # or there would be nothing to refine
    assert max(refined_misses) < 0.02e-3
    assert min(refined_misses) > -0.1e-3  # the dense points miss a little too
