"""Clearances and penetration against a loop over MuJoCo's geoms."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.hands.shapes import covering_spheres
from fingersplit.objects.signed_distance_kernel import SLACK
from fingersplit.splitting.collision_kernel import RANGE, measure_clearances, rough_penetration
from fingersplit.transforms import pose_matrix, wxyz_from_rotation

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def random_hand(barrett, mujoco_barrett, posed_state) -> Callable[[np.random.Generator, float], np.record]:
    """A hand about as far from the origin as a reach [m], the same for MuJoCo."""

    def pose(rng: np.random.Generator, reach: float) -> np.record:
        joints = rng.uniform(barrett.lower, barrett.upper)
        rotation, position = Rotation.random(rng=rng).as_matrix(), rng.uniform(-reach, reach, 3)
        mujoco_barrett.move(dict(zip(barrett.joint_names, joints, strict=True)), wxyz_from_rotation(rotation), position)
        return posed_state(joints, pose_matrix(rotation, position))

    return pose


@pytest.mark.parametrize("name", ["mug", "box"])
@given(seed=seeds, reach=st.sampled_from([0.05, 0.15]))
def test_clearances_are_the_distances_of_the_nearest_points(
    barrett, mujoco_barrett, prepared, random_hand, name, seed, reach
):
    model = prepared(name)
    state, points = random_hand(np.random.default_rng(seed), reach), model.collision.points
    measure_clearances(barrett.arrays, state, model.collision, model.distance, np.empty((3, 3)))
    for k, shape in enumerate(barrett.shape_names):
        distances = mujoco_barrett.geom_distance(shape, points)
        if distances.min() >= RANGE:
            assert state.clearances[k] == math.inf, shape
            continue
        assert state.clearances[k] == pytest.approx(distances.min(), abs=1e-12)
        at = state.clearance_points[k]
        assert (points == at).all(axis=1).any()
        assert mujoco_barrett.geom_distance(shape, at[None])[0] == pytest.approx(distances.min(), abs=1e-12)
        steps = 1e-7 * np.eye(3)
        ahead, behind = (mujoco_barrett.geom_distance(shape, at + sign * steps) for sign in (1, -1))
        slopes = (ahead - behind) / 2e-7
        if abs(np.linalg.norm(slopes) - 1) < 1e-6:  # elsewhere two faces are equally near
            np.testing.assert_allclose(state.clearance_normals[k], slopes, atol=1e-5)
    assert state.penetration == pytest.approx(mujoco_barrett.depth(points), abs=1e-12)


def test_hands_near_far_and_inside_are_all_met(barrett, prepared, random_hand):
    model, found = prepared("mug"), []
    for seed in range(80):
        state = random_hand(np.random.default_rng(seed), 0.15)
        measure_clearances(barrett.arrays, state, model.collision, model.distance, np.empty((3, 3)))
        found.append(state.clearances[: len(barrett.shape_names)].copy())
    clearances = np.array(found)
    assert (clearances < 0).sum() > 10
    assert ((clearances > 0) & (clearances < RANGE)).sum() > 5
    assert np.isinf(clearances).sum() > 10


def test_hand_far_away_touches_nothing(barrett, prepared, posed_state):
    model, state = prepared("mug"), posed_state(barrett.lower, pose_matrix(np.eye(3), (0, 0, 1.0)))
    measure_clearances(barrett.arrays, state, model.collision, model.distance, np.empty((3, 3)))
    assert state.penetration == 0
    assert np.isinf(state.clearances[: len(barrett.shape_names)]).all()
    assert rough_penetration(barrett.arrays, state, model.distance, np.inf) == 0


@pytest.mark.parametrize("name", ["sphere", "box"])
@given(seed=seeds)
def test_rough_penetration_is_that_of_spheres_inside_the_links(
    barrett, mujoco_barrett, prepared, exact_mesh, random_hand, name, seed
):
    model = prepared(name)
    state = random_hand(np.random.default_rng(seed), 0.12)
    depths = []
    for shape in mujoco_barrett.collision_shapes:
        g = mujoco_barrett.model.geom(shape).id
        centers, _, insides = covering_spheres(mujoco_barrett.model.geom_type[g], mujoco_barrett.model.geom_size[g])
        rotation, position = mujoco_barrett.geom(shape)
        placed = centers @ rotation.T + position
        outside = np.where(model.mesh.trimesh.contains(placed), -1, 1)
        depths.append((insides - outside * exact_mesh(model.mesh).distance(placed)).max())
    found = rough_penetration(barrett.arrays, state, model.distance, np.inf)
    assert found == pytest.approx(max(0.0, *depths), abs=SLACK * model.distance.cell)
