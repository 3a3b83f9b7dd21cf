"""The tangent steps of CPO and PPO against eqs. (4) and (7) of [Fan2018], written out densely with NumPy."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.hands import Hand
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.splitting.contact_optimization_kernel import tangent_step
from fingersplit.splitting.objective_kernel import manipulability_gradient, object_quality_gradient
from fingersplit.splitting.palm_optimization_kernel import move_palm, palm_tangent_step
from fingersplit.splitting.potential_kernel import add_penalty_gradient
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.state import new_states, new_work
from fingersplit.splitting.state_kernel import evaluate
from fingersplit.splitting.tracking_kernel import LIMIT_MARGIN

seeds = st.integers(0, 2**32 - 1)
SETTINGS = PlannerSettings.of("paper")
PUSHED = PlannerSettings(joint_limit_margin=0.4)  # with potentials that act nearly everywhere


def random_state(hand: Hand, rng: np.random.Generator, *, at_limits: bool = False) -> np.record:
    """A hand anywhere, its pads touching a made-up surface of random normals, its links near made-up points."""
    state, fingers, shapes = new_states(1)[0], len(hand.fingers), len(hand.shape_names)
    joints = rng.uniform(hand.lower + 0.01, hand.upper - 0.01)
    if at_limits:
        chance = rng.random(joints.size)
        joints = np.where(chance < 0.25, hand.lower, np.where(chance > 0.75, hand.upper, joints))
    state.joints[: joints.size] = state.drivers[: joints.size] = joints
    state.palm_rotation[:] = Rotation.random(rng=rng).as_matrix()
    state.palm_position[:] = rng.uniform(-0.2, 0.2, 3)
    move_fingers(hand.arrays, state)
    state.normals[:fingers] = random_directions(rng, fingers)
    state.contacts[:fingers] = state.pads[:fingers] - pad_radii(hand) * state.normals[:fingers]
    state.clearances[:shapes] = rng.uniform(-1e-3, 4e-3, shapes)
    state.clearance_points[:shapes] = rng.uniform(-0.2, 0.2, (shapes, 3))
    state.clearance_normals[:shapes] = random_directions(rng, shapes)
    return state


def random_directions(rng: np.random.Generator, count: int) -> np.ndarray:
    directions = rng.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def pad_radii(hand: Hand) -> np.ndarray:
    return np.array([[finger.pad_radius] for finger in hand.fingers])


def gradients(hand: Hand, state: np.record) -> tuple[np.ndarray, np.ndarray]:
    """Of Q, by the contacts and by the joints."""
    by_contacts, by_joints = np.full(state.contacts.shape, np.nan), np.full(len(hand.joint_names), np.nan)
    object_quality_gradient(state.contacts, len(hand.fingers), by_contacts)
    manipulability_gradient(hand.arrays, state.joints, by_joints)
    contacts = by_contacts[: len(hand.fingers)].ravel()
    return SETTINGS.object_weight * contacts, SETTINGS.hand_weight * by_joints


def hand_jacobian(hand: Hand, state: np.record) -> np.ndarray:
    """Block-diagonal in the fingers: (3 F, N)."""
    J = np.zeros((3 * len(hand.fingers), len(hand.joint_names)))
    for f, finger in enumerate(hand.fingers):
        count = len(finger.joint_names)
        J[3 * f : 3 * f + 3, hand.arrays.joint_indices[f, :count]] = state.jacobians[f, :, :count]
    return J


def pushed_outwards(hand: Hand, state: np.record, step: np.ndarray) -> np.ndarray:
    q = state.joints[: step.size]
    return ((step > 0) & (q >= hand.upper - LIMIT_MARGIN)) | ((step < 0) & (q <= hand.lower + LIMIT_MARGIN))


def dense_cpo_step(
    hand: Hand, state: np.record, g_c: np.ndarray, g_q: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eq. (4) with its full A; joints at a limit and pushed outwards lose their column. Also says which stayed."""
    J, free = hand_jacobian(hand, state), np.ones(g_q.size, bool)
    normals = scipy.linalg.block_diag(*(normal[None] for normal in state.normals[: len(hand.fingers)]))
    while True:
        A = np.block([[normals, np.zeros((len(normals), free.sum()))], [-np.eye(len(J)), J[:, free]]])
        g = np.concatenate([g_c, g_q[free]])
        d = g - A.T @ np.linalg.lstsq(A.T, g, rcond=1e-12)[0]  # (A A^T)^-1 A g, also where a whole finger left
        step = np.zeros(g_q.size)
        step[free] = d[g_c.size :]
        outwards = pushed_outwards(hand, state, step)
        if not outwards.any():
            moves = np.linalg.norm(d) > 1e-9 * np.hypot(np.linalg.norm(g_c), np.linalg.norm(g_q))
            d *= radius / np.linalg.norm(d) if moves else 0.0
            step[free] = d[g_c.size :]
            return d[: g_c.size], step, free
        free &= ~outwards


def dense_ppo_step(
    hand: Hand, state: np.record, center: np.ndarray, g_V: np.ndarray, g: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Eq. (7), with the contact's ball joint at the pad's centre: the gradient's projection on G^T V = J q_dot."""
    J, free = hand_jacobian(hand, state), np.ones(g.size, bool)
    G = grasp_map(hand, state, center)
    while True:
        A = np.hstack([G.T, -J[:, free]])
        gradient = np.concatenate([g_V, g[free]])
        d = gradient - A.T @ np.linalg.solve(A @ A.T, A @ gradient)
        d_V, d_q = d[:6], np.zeros(g.size)
        d_q[free] = d[6:]
        outwards = pushed_outwards(hand, state, d_q)
        if not outwards.any():
            moves = np.linalg.norm(d_q) > 1e-9 * np.linalg.norm(g)  # else no joint can, and the object stands still
            speed = radius / np.linalg.norm(d_q) if moves else 0.0
            return speed * d_V, speed * d_q
        free &= ~outwards


def grasp_map(hand: Hand, state: np.record, center: np.ndarray) -> np.ndarray:
    """(6, 3 F): contact forces to wrench about ``center``."""
    fingers = len(hand.fingers)
    arms = state.contacts[:fingers] + pad_radii(hand) * state.normals[:fingers] - center
    return np.hstack([np.vstack([np.eye(3), skew(arm)]) for arm in arms])


def skew(v) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def paper_cpo_step(hand: Hand, state: np.record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return dense_cpo_step(hand, state, *gradients(hand, state), 0.15)


def paper_ppo_step(hand: Hand, state: np.record, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return dense_ppo_step(hand, state, center, np.zeros(6), gradients(hand, state)[1], 0.5)


def cpo_step(
    hand: Hand, state: np.record, settings: PlannerSettings = SETTINGS, radius: float = SETTINGS.cpo_trust_region
) -> tuple[np.ndarray, np.ndarray]:
    work = new_work()
    tangent_step(hand.arrays, settings.for_kernels(), (0.0, 0.0, 0.0), state, work, radius)
    return work.step.contact_step[: len(hand.fingers)].ravel(), work.step.driver_step[: len(hand.joint_names)]


def ppo_step(
    hand: Hand,
    state: np.record,
    center: np.ndarray,
    settings: PlannerSettings = SETTINGS,
    radius: float = SETTINGS.ppo_trust_region,
) -> tuple[np.ndarray, np.ndarray]:
    work = new_work()
    palm_tangent_step(hand.arrays, settings.for_kernels(), tuple(center.tolist()), state, work, radius)
    return work.step.twist, work.step.driver_step[: len(hand.joint_names)]


def push_gradients(hand: Hand, state: np.record, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Minus the gradients of the potentials (``test_potential`` proves them), by the twist and by the joints."""
    work = new_work()
    add_penalty_gradient(hand.arrays, PUSHED.for_kernels(), state, tuple(center.tolist()), work.step)
    return work.step.twist_gradient.copy(), work.step.driver_gradient[: len(hand.joint_names)].copy()


@given(seed=seeds)
def test_cpo_step_is_equation_4(barrett, seed):
    state = random_state(barrett, np.random.default_rng(seed))
    contact_step, joint_step = cpo_step(barrett, state)
    dense_contact_step, dense_joint_step, free = paper_cpo_step(barrett, state)
    assert free.all()
    np.testing.assert_allclose(contact_step, dense_contact_step, atol=1e-12)
    np.testing.assert_allclose(joint_step, dense_joint_step, atol=1e-12)


@given(seed=seeds)
def test_cpo_step_without_joints_at_their_limits_is_equation_4_without_their_columns(barrett, seed):
    state = random_state(barrett, np.random.default_rng(seed), at_limits=True)
    contact_step, joint_step = cpo_step(barrett, state)
    dense_contact_step, dense_joint_step, _ = paper_cpo_step(barrett, state)
    np.testing.assert_allclose(contact_step, dense_contact_step, atol=1e-11)
    np.testing.assert_allclose(joint_step, dense_joint_step, atol=1e-11)


def test_some_joints_do_leave_the_active_set(barrett):
    states = [random_state(barrett, np.random.default_rng(seed), at_limits=True) for seed in range(30)]
    left = [(~paper_cpo_step(barrett, state)[2]).sum() for state in states]
    assert np.mean(left) > 0.2


@given(seed=seeds, at_limits=st.booleans())
def test_cpo_step_stays_in_the_tangent_space_and_the_trust_region(barrett, seed, at_limits):
    state = random_state(barrett, np.random.default_rng(seed), at_limits=at_limits)
    contact_step, joint_step = cpo_step(barrett, state)
    np.testing.assert_allclose((state.normals[:3] * contact_step.reshape(-1, 3)).sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(contact_step, hand_jacobian(barrett, state) @ joint_step, atol=1e-12)
    length = np.hypot(np.linalg.norm(contact_step), np.linalg.norm(joint_step))
    if at_limits and length == 0:  # every finger with one free joint: nowhere to go
        return
    assert length == pytest.approx(0.15)
    g_c, g_q = gradients(barrett, state)
    assert g_c @ contact_step + g_q @ joint_step > 0


def test_no_step_where_no_finger_can_move_along_the_surface(barrett):
    state = random_state(barrett, np.random.default_rng(1340), at_limits=True)
    contact_step, joint_step = cpo_step(barrett, state)
    np.testing.assert_array_equal(contact_step, 0)
    np.testing.assert_array_equal(joint_step, 0)


@given(seed=seeds)
def test_ppo_step_is_equation_7(barrett, seed):
    rng = np.random.default_rng(seed)
    state, center = random_state(barrett, rng), rng.uniform(-0.1, 0.1, 3)
    twist, joint_step = ppo_step(barrett, state, center)
    dense_twist, dense_joint_step = paper_ppo_step(barrett, state, center)
    np.testing.assert_allclose(twist, dense_twist, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(joint_step, dense_joint_step, rtol=1e-8, atol=1e-10)


@given(seed=seeds, at_limits=st.booleans())
def test_ppo_step_moves_object_and_fingertips_together(barrett, seed, at_limits):
    rng = np.random.default_rng(seed)
    state, center = random_state(barrett, rng, at_limits=at_limits), rng.uniform(-0.1, 0.1, 3)
    twist, joint_step = ppo_step(barrett, state, center)
    G, J = grasp_map(barrett, state, center), hand_jacobian(barrett, state)
    np.testing.assert_allclose(G.T @ twist, J @ joint_step, atol=1e-10)
    assert np.linalg.norm(joint_step) == pytest.approx(0.5)
    assert not pushed_outwards(barrett, state, joint_step).any()
    dense_twist, dense_joint_step = paper_ppo_step(barrett, state, center)
    np.testing.assert_allclose(twist, dense_twist, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(joint_step, dense_joint_step, rtol=1e-8, atol=1e-10)


@given(seed=seeds, at_limits=st.booleans(), radius=st.sampled_from([0.15, 0.02]))
def test_with_potentials_both_steps_project_the_gradient_of_the_merit(barrett, seed, at_limits, radius):
    rng = np.random.default_rng(seed)
    state, center = random_state(barrett, rng, at_limits=at_limits), rng.uniform(-0.1, 0.1, 3)
    evaluate(barrett.arrays, PUSHED.for_kernels(), state)
    g_V, push = push_gradients(barrett, state, center)
    assert np.linalg.norm(g_V) > 0
    assert np.linalg.norm(push) > 0
    g_c, g_q = gradients(barrett, state)
    contact_step, joint_step = cpo_step(barrett, state, PUSHED, radius)
    dense_contact_step, dense_joint_step, _ = dense_cpo_step(barrett, state, g_c, g_q + push, radius)
    np.testing.assert_allclose(contact_step, dense_contact_step, atol=1e-11)
    np.testing.assert_allclose(joint_step, dense_joint_step, atol=1e-11)
    twist, joint_step = ppo_step(barrett, state, center, PUSHED, radius)
    dense_twist, dense_joint_step = dense_ppo_step(barrett, state, center, g_V, g_q + push, radius)
    np.testing.assert_allclose(twist, dense_twist, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(joint_step, dense_joint_step, rtol=1e-8, atol=1e-10)


@given(seed=seeds, duration=st.sampled_from([0.0, 1e-9, 0.05, 1.0, 3.0]))
def test_palm_moves_by_the_exponential_of_the_twist(barrett, seed, duration):
    rng = np.random.default_rng(seed)
    twist, center = rng.normal(size=6), rng.uniform(-0.1, 0.1, 3)
    old, new = random_state(barrett, rng), new_states(1)[0]
    move_palm(twist, duration, tuple(center.tolist()), old, np.empty((3, 3)), new)
    velocity = np.zeros((4, 4))
    velocity[:3, :3], velocity[:3, 3] = skew(twist[3:]), twist[:3]
    to_center, object_from_palm = np.eye(4), np.eye(4)
    to_center[:3, 3] = -center
    object_from_palm[:3, :3], object_from_palm[:3, 3] = old.palm_rotation, old.palm_position
    back = scipy.linalg.expm(-duration * velocity)  # the palm sees the object move, the object the palm
    expected = np.linalg.inv(to_center) @ back @ to_center @ object_from_palm
    np.testing.assert_allclose(new.palm_rotation, expected[:3, :3], atol=1e-12)
    np.testing.assert_allclose(new.palm_position, expected[:3, 3], atol=1e-12)


@given(seed=seeds)
def test_palm_and_joints_keep_the_contacts_to_first_order(barrett, seed):
    rng = np.random.default_rng(seed)
    state, center = random_state(barrett, rng), rng.uniform(-0.1, 0.1, 3)
    twist, joint_step = ppo_step(barrett, state, center)
    moved, slips = new_states(1)[0], []
    for duration in (0.01, 0.005):
        move_palm(twist, duration, tuple(center.tolist()), state, np.empty((3, 3)), moved)
        moved.joints[:8] = state.joints[:8] + duration * joint_step
        move_fingers(barrett.arrays, moved)
        slips.append(np.linalg.norm(moved.pads - state.pads))
    travelled = 0.005 * np.linalg.norm(hand_jacobian(barrett, state) @ joint_step)
    assert slips[1] < 0.05 * travelled + 1e-9
    assert slips[0] / slips[1] == pytest.approx(4, rel=0.1)
