"""Penetration of surface points into links against a loop over MuJoCo's geoms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.splitting.collision import penetration
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
