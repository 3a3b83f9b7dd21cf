"""Poses and quaternions: round trips and the order of composition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.transforms import (
    pose_matrix,
    rotation_from_wxyz,
    rotation_to_axis,
    transform_points,
    wxyz_from_rotation,
)

seeds = st.integers(0, 2**32 - 1)


def random_pose(rng: np.random.Generator) -> np.ndarray:
    return pose_matrix(Rotation.random(rng=rng).as_matrix(), rng.normal(size=3))


@given(seeds)
def test_rotation_survives_its_quaternion(seed):
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    wxyz = wxyz_from_rotation(rotation)
    assert wxyz.shape == (4,)
    assert wxyz[0] >= 0
    assert abs(np.linalg.norm(wxyz) - 1) < 1e-12
    np.testing.assert_allclose(rotation_from_wxyz(wxyz), rotation, atol=1e-12)
    np.testing.assert_allclose(rotation_from_wxyz(-3 * wxyz), rotation, atol=1e-12)


@given(seeds, st.floats(0, 1e-9))
def test_turns_by_half_a_circle_keep_their_axis(seed, less):
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    wxyz = wxyz_from_rotation(Rotation.from_rotvec((np.pi - less) * axis).as_matrix())
    assert wxyz[0] >= 0
    assert abs(wxyz[1:] @ axis) == pytest.approx(1)


def test_scalar_stands_first():
    np.testing.assert_allclose(wxyz_from_rotation(np.eye(3)), [1, 0, 0, 0])
    quarter_turn_about_z = rotation_from_wxyz([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    np.testing.assert_allclose(quarter_turn_about_z @ [1, 0, 0], [0, 1, 0], atol=1e-15)


@given(seeds)
def test_names_cancel_in_a_composition(seed):
    rng = np.random.default_rng(seed)
    a_from_b, b_from_c, points_in_c = random_pose(rng), random_pose(rng), rng.normal(size=(4, 5, 3))
    step_by_step = transform_points(a_from_b, transform_points(b_from_c, points_in_c))
    np.testing.assert_allclose(transform_points(a_from_b @ b_from_c, points_in_c), step_by_step, atol=1e-12)
    back = transform_points(np.linalg.inv(a_from_b), transform_points(a_from_b, points_in_c))
    np.testing.assert_allclose(back, points_in_c, atol=1e-12)


@given(seeds)
def test_rotation_to_axis_turns_z_there(seed):
    axis = np.random.default_rng(seed).normal(size=3)
    rotation = rotation_to_axis(axis)
    np.testing.assert_allclose(rotation[:, 2], axis / np.linalg.norm(axis), atol=1e-12)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) > 0


def test_rotation_to_axis_also_along_the_axes():
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        rotation = rotation_to_axis(axis)
        np.testing.assert_allclose(rotation[:, 2], axis, atol=1e-15)
        assert abs(np.linalg.det(rotation) - 1) < 1e-12
