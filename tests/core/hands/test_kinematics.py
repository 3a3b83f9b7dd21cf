"""Links, pads and Jacobians against MuJoCo and finite differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.transforms import pose_matrix, transform_points

seeds = st.integers(0, 2**32 - 1)


def random_joints(hand, rng) -> np.ndarray:
    return rng.uniform(hand.lower, hand.upper)


def random_palm(rng) -> np.ndarray:
    return pose_matrix(Rotation.random(rng=rng).as_matrix(), rng.uniform(-0.3, 0.3, 3))


@given(seed=seeds)
def test_links_and_pads_stand_where_mujoco_has_them(barrett, mujoco_barrett, seed):
    joints = random_joints(barrett, np.random.default_rng(seed))
    mujoco_barrett.move(dict(zip(barrett.joint_names, joints, strict=True)))
    pose = barrett.pose(joints)
    for f, finger in enumerate(barrett.fingers):
        for j, joint in enumerate(finger.joint_names):
            rotation, position = mujoco_barrett.joint(joint)
            np.testing.assert_allclose(pose.link_rotations[f, j], rotation, atol=1e-12)
            np.testing.assert_allclose(pose.link_positions[f, j], position, atol=1e-12)
        position, normal = mujoco_barrett.site(f"{finger.name}_pad")
        np.testing.assert_allclose(pose.pads[f], position, atol=1e-12)
        np.testing.assert_allclose(pose.pad_normals[f], normal, atol=1e-12)


@given(seed=seeds)
def test_pose_of_the_palm_moves_everything_with_it(barrett, seed):
    rng = np.random.default_rng(seed)
    joints, object_from_palm = random_joints(barrett, rng), random_palm(rng)
    in_palm, in_object = barrett.pose(joints), barrett.pose(joints, object_from_palm)
    rotation = object_from_palm[:3, :3]
    np.testing.assert_allclose(in_object.pads[:3], transform_points(object_from_palm, in_palm.pads[:3]), atol=1e-12)
    np.testing.assert_allclose(in_object.pad_normals, in_palm.pad_normals @ rotation.T, atol=1e-12)
    np.testing.assert_allclose(in_object.jacobians, rotation @ in_palm.jacobians, atol=1e-12)


@given(seed=seeds)
def test_jacobians_agree_with_finite_differences(barrett, seed):
    rng = np.random.default_rng(seed)
    joints, object_from_palm, step = random_joints(barrett, rng), random_palm(rng), 1e-6
    pose = barrett.pose(joints, object_from_palm)
    for f, finger in enumerate(barrett.fingers):
        for column, name in enumerate(finger.joint_names):
            turn = step * np.eye(8)[barrett.joint_names.index(name)]
            ahead, behind = (barrett.pose(joints + s * turn, object_from_palm).pads[f] for s in (1, -1))
            np.testing.assert_allclose(pose.jacobians[f, :, column], (ahead - behind) / (2 * step), atol=1e-8)
        assert (pose.jacobians[f, :, len(finger.joint_names) :] == 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_drawn_shapes_lie_on_the_collision_shapes(barrett, mujoco_barrett, seed):
    joints = random_joints(barrett, np.random.default_rng(seed))
    mujoco_barrett.move(dict(zip(barrett.joint_names, joints, strict=True)))
    meshes = barrett.posed_meshes(joints)
    assert [name for name, _, _ in meshes] == list(barrett.shape_names)
    assert len(meshes) == len(mujoco_barrett.collision_shapes)
    for name, vertices, faces in meshes:
        assert faces.max() < len(vertices)
        distances = mujoco_barrett.geom_distance(name, vertices)
        assert np.abs(distances).max() < 1e-9, name
