"""Tracking within joint limits against SciPy's bounded least squares."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from fingersplit.hands import Hand
from fingersplit.splitting.state import new_work
from fingersplit.splitting.tracking_kernel import DAMPING, at_limit, track

seeds = st.integers(0, 2**32 - 1)


def tracked(hand: Hand, joints: np.ndarray, finger: int, displacement: np.ndarray) -> np.ndarray:
    pose, displacements = hand.pose(joints), np.zeros((len(hand.fingers), 3))
    pose.drivers[: len(joints)], displacements[finger] = joints, displacement
    after = np.array(pose.drivers)
    track(hand.arrays, pose, displacements, new_work().solver, after)
    return after[: len(joints)]


def bounded_least_squares(hand: Hand, joints: np.ndarray, finger: int, displacement: np.ndarray) -> np.ndarray:
    own = hand.arrays.joint_indices[finger, : hand.arrays.joint_counts[finger]]
    J = hand.pose(joints).jacobians[finger, :, : own.size]
    A, b = np.vstack([J, DAMPING * np.eye(own.size)]), np.concatenate([displacement, np.zeros(own.size)])
    slack = 1e-12  # SciPy wants room between its bounds
    bounds = hand.lower[own] - joints[own] - slack, hand.upper[own] - joints[own] + slack
    after = joints.copy()
    after[own] += lsq_linear(A, b, bounds, method="bvls", tol=1e-14).x
    return after


def random_case(hand: Hand, seed: int, reach: float, at_limits: float) -> tuple[np.ndarray, int, np.ndarray]:
    rng = np.random.default_rng(seed)
    chance = rng.random(8)
    joints = rng.uniform(hand.lower, hand.upper)
    joints = np.where(chance < at_limits / 2, hand.lower, np.where(chance > 1 - at_limits / 2, hand.upper, joints))
    return joints, int(rng.integers(3)), reach * rng.normal(size=3)


def cost(hand: Hand, joints: np.ndarray, finger: int, displacement: np.ndarray, after: np.ndarray) -> float:
    moved = after - joints
    own = hand.arrays.joint_indices[finger, : hand.arrays.joint_counts[finger]]
    missed = hand.pose(joints).jacobians[finger, :, : own.size] @ moved[own] - displacement
    return float(missed @ missed + DAMPING**2 * moved @ moved)


@given(seed=seeds, reach=st.sampled_from([1e-5, 1e-3, 1e-2, 5e-2]), at_limits=st.sampled_from([0.0, 0.5, 0.9]))
def test_tracking_is_bounded_least_squares(barrett, seed, reach, at_limits):
    joints, finger, displacement = random_case(barrett, seed, reach, at_limits)
    after = tracked(barrett, joints, finger, displacement)
    np.testing.assert_allclose(after, bounded_least_squares(barrett, joints, finger, displacement), atol=1e-9)


@given(seed=seeds, reach=st.sampled_from([1e-4, 1e-3, 1e-2, 0.1]))
def test_no_joint_leaves_its_limits_and_no_other_finger_moves(barrett, seed, reach):
    joints, finger, displacement = random_case(barrett, seed, reach, at_limits=0.4)
    after = tracked(barrett, joints, finger, displacement)
    assert (after >= barrett.lower).all()
    assert (after <= barrett.upper).all()
    others = np.delete(np.arange(8), barrett.arrays.joint_indices[finger, : barrett.arrays.joint_counts[finger]])
    np.testing.assert_array_equal(after[others], joints[others])
    assert cost(barrett, joints, finger, displacement, after) <= displacement @ displacement * (1 + 1e-9)


def test_the_others_take_over_from_a_joint_at_its_limit(barrett):
    joints = (barrett.lower + barrett.upper) / 2
    proximal, distal = barrett.arrays.joint_indices[2, :2]
    joints[distal] = barrett.upper[distal]
    closing = 1e-3 * barrett.pose(joints).jacobians[2, :, 1]
    after = tracked(barrett, joints, 2, closing)
    assert after[distal] == barrett.upper[distal]
    assert after[proximal] > joints[proximal]


def test_at_limit_asks_for_the_direction(barrett):
    hand, joints = barrett.arrays, (barrett.lower + barrett.upper) / 2
    assert not at_limit(hand, joints, 0, 1.0)
    assert not at_limit(hand, joints, 0, -1.0)
    joints[0] = barrett.upper[0]
    assert at_limit(hand, joints, 0, 1e-12)
    assert not at_limit(hand, joints, 0, -1.0)
    joints[0] = barrett.lower[0]
    assert at_limit(hand, joints, 0, -1e-12)
    assert not at_limit(hand, joints, 0, 0.0)
