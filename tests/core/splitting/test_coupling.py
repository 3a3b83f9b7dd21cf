"""Drivers that move several joints or fingers, against dense linear algebra for random S."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from fingersplit.errors import HandError
from fingersplit.hands.drivers import driver_jacobians, joints_of, set_drivers
from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.hands.limits import MAX_CHAIN_DRIVERS, MAX_DRIVERS
from fingersplit.splitting.contact_optimization_kernel import tangent_step
from fingersplit.splitting.objective_kernel import manipulability_gradient, object_quality_gradient
from fingersplit.splitting.palm_optimization_kernel import palm_tangent_step
from fingersplit.splitting.pull_kernel import LENGTH
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.sliding_kernel import slides, sliding_step
from fingersplit.splitting.state import new_states, new_work
from fingersplit.splitting.tracking_kernel import DAMPING, track

SETTINGS = PlannerSettings.of("paper")
CENTER = np.array([0.01, -0.02, 0.03])
seeds = st.integers(0, 2**32 - 1)
AS_BUILT = np.zeros((8, 4))  # the Barrett hand: one spread for two fingers, distal joints follow proximal ones
AS_BUILT[[0, 3], 0] = 1.0
for _proximal, _distal, _driver in ((1, 2, 1), (4, 5, 2), (6, 7, 3)):
    AS_BUILT[[_proximal, _distal], _driver] = 1.0, 1 / 3


def coupled(barrett, coupling: np.ndarray, offset: np.ndarray, width: float = 10.0) -> np.record:
    """The Barrett hand with other drivers, each free by ``width`` [rad] about zero; joint limits wide."""
    hand = np.rec.array(np.array([barrett.arrays]))[0]
    hand.lower[:8], hand.upper[:8] = -100.0, 100.0
    hand.coupling[:], hand.coupling_offset[:] = 0.0, 0.0
    drivers = coupling.shape[1]
    set_drivers(hand, coupling, offset, np.full(drivers, -width), np.full(drivers, width))
    return hand


def random_coupling(rng: np.random.Generator) -> np.ndarray:
    """S (8, A) with every driver in use: any joint may follow up to two drivers."""
    drivers = int(rng.integers(4, 9))
    coupling = np.zeros((8, drivers))
    for joint in range(8):
        coupling[joint, rng.integers(drivers)] = rng.uniform(0.3, 1.5)
        if rng.random() < 0.3:
            coupling[joint, rng.integers(drivers)] = rng.uniform(-1.0, 1.0)
    return coupling[:, coupling.any(axis=0)]


def random_state(hand: np.record, rng: np.random.Generator) -> np.record:
    state = new_states(1)[0]
    state.drivers[: hand.driver_count] = rng.uniform(0.1, 0.9, hand.driver_count)
    state.palm_rotation[:], state.palm_position[:] = np.eye(3), rng.uniform(-0.1, 0.1, 3)
    move_drivers(hand, state)
    normals = rng.normal(size=(3, 3))
    state.normals[:3] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    state.contacts[:3] = state.pads[:3] - hand.pad_radii[:3, None] * state.normals[:3]
    return state


@given(seed=seeds)
def test_jacobians_are_slopes_of_the_pads_by_the_drivers(barrett, seed):
    rng = np.random.default_rng(seed)
    hand = coupled(barrett, random_coupling(rng), rng.uniform(-0.3, 0.3, 8))
    state = random_state(hand, rng)
    dense = driver_jacobians(hand, state.jacobians)
    for driver in range(hand.driver_count):
        pads = []
        for change in (1e-6, -1e-6):
            moved = new_states(1)
            moved[0] = state
            moved[0].drivers[driver] += change
            move_drivers(hand, moved[0])
            pads.append(moved[0].pads[:3].copy())
        np.testing.assert_allclose(dense[:, :, driver], (pads[0] - pads[1]) / 2e-6, atol=1e-8)
    drivers = state.drivers[: hand.driver_count]
    np.testing.assert_allclose(joints_of(hand, drivers), state.joints[:8], atol=1e-14)


def gradients(hand: np.record, state: np.record) -> tuple[np.ndarray, np.ndarray]:
    by_contacts, by_drivers = np.zeros(state.contacts.shape), np.zeros(hand.driver_count)
    object_quality_gradient(state.contacts, 3, by_contacts)
    manipulability_gradient(hand, state.drivers, by_drivers)
    return SETTINGS.object_weight * by_contacts[:3].ravel(), SETTINGS.hand_weight * by_drivers


@given(seed=seeds)
def test_cpo_step_of_random_couplings_is_equation_4(barrett, seed):
    rng = np.random.default_rng(seed)
    hand = coupled(barrett, random_coupling(rng), np.zeros(8))
    state, work = random_state(hand, rng), new_work()
    tangent_step(hand, SETTINGS.for_kernels(), tuple(CENTER.tolist()), state, work, 0.15)
    step = np.concatenate([work.step.contact_step[:3].ravel(), work.step.driver_step[: hand.driver_count]])
    J, g = driver_jacobians(hand, state.jacobians).reshape(9, -1), np.concatenate(gradients(hand, state))
    normals = np.zeros((3, 9))
    for finger in range(3):
        normals[finger, 3 * finger : 3 * finger + 3] = state.normals[finger]
    A = np.block([[normals, np.zeros((3, J.shape[1]))], [-np.eye(9), J]])
    dense = g - A.T @ np.linalg.lstsq(A.T, g, rcond=1e-12)[0]
    moves = np.linalg.norm(dense) > 1e-9 * np.linalg.norm(g)  # with few drivers the constraints may leave no way to go
    expected = 0.15 * dense / np.linalg.norm(dense) if moves else np.zeros_like(dense)
    np.testing.assert_allclose(step, expected, atol=1e-10 * 0.15 / np.linalg.norm(dense) if moves else 1e-12)


@given(seed=seeds)
def test_ppo_step_of_random_couplings_is_equation_7(barrett, seed):
    rng = np.random.default_rng(seed)
    hand = coupled(barrett, random_coupling(rng), np.zeros(8))
    state, work = random_state(hand, rng), new_work()
    palm_tangent_step(hand, SETTINGS.for_kernels(), tuple(CENTER.tolist()), state, work, 0.5)
    J, (_, g) = driver_jacobians(hand, state.jacobians).reshape(9, -1), gradients(hand, state)
    arms = state.pads[:3] - CENTER
    cross = [np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) for x, y, z in arms]
    G = np.hstack([np.vstack([np.eye(3), arm]) for arm in cross])
    A, gradient = np.hstack([G.T, -J]), np.concatenate([np.zeros(6), g])
    dense = gradient - A.T @ np.linalg.solve(A @ A.T, A @ gradient)
    if np.linalg.norm(dense[6:]) > 1e-6 * np.linalg.norm(g):
        scale = 0.5 / np.linalg.norm(dense[6:])
        found = np.concatenate([work.step.twist, work.step.driver_step[: hand.driver_count]])
        np.testing.assert_allclose(found, scale * dense, atol=1e-9 * scale)


@given(seed=seeds, width=st.sampled_from([1.0, 10.0]))
def test_tracking_by_coupled_drivers_is_bounded_least_squares(barrett, seed, width):
    rng = np.random.default_rng(seed)
    hand = coupled(barrett, AS_BUILT, np.zeros(8), width)
    assert hand.fingers_coupled
    state, displacements = random_state(hand, rng), 0.03 * rng.normal(size=(3, 3))
    drivers, after = state.drivers[:4].copy(), np.zeros(MAX_DRIVERS)
    track(hand, state, displacements, new_work().solver, after)
    J = driver_jacobians(hand, state.jacobians).reshape(9, -1)
    A, b = np.vstack([J, DAMPING * np.eye(4)]), np.concatenate([displacements.ravel(), np.zeros(4)])
    expected = lsq_linear(A, b, (-width - drivers, width - drivers), method="bvls", tol=1e-14).x
    np.testing.assert_allclose(after[:4], drivers + expected, atol=1e-8)


@given(seed=seeds)
def test_joints_of_several_drivers_keep_their_limits(barrett, seed):
    rng = np.random.default_rng(seed)
    coupling = np.eye(8)
    coupling[2, 1], coupling[5, 4] = 0.5, 0.5
    hand = coupled(barrett, coupling, np.zeros(8))
    state = random_state(hand, rng)
    hand.lower[:8], hand.upper[:8] = state.joints[:8] - 0.02, state.joints[:8] + 0.02
    after = np.zeros(MAX_DRIVERS)
    track(hand, state, 0.05 * rng.normal(size=(3, 3)), new_work().solver, after)
    joints = joints_of(hand, after[:8])
    assert hand.mixed_count == 2
    assert (np.abs(joints - state.joints[:8])[[2, 5]] <= 0.02 + 1e-9).all()


def test_uncoupled_hands_are_known_as_such(barrett):
    assert barrett.arrays.uncoupled
    assert not barrett.arrays.fingers_coupled
    inside_fingers = np.delete(np.eye(8), [2, 5, 7], axis=1)
    inside_fingers[2, 1] = inside_fingers[5, 3] = inside_fingers[7, 4] = 1 / 3
    hand = coupled(barrett, inside_fingers, np.zeros(8))
    assert not hand.uncoupled
    assert not hand.fingers_coupled


@pytest.mark.parametrize(
    ("coupling", "lower", "upper", "sentence"),
    [
        (np.zeros((8, 1)), -1.0, 1.0, "moves no joint"),
        (np.ones((8, 1)), 1.0, 1.0, "give a finite range"),
        (np.ones((8, 1)), -np.inf, 1.0, "give a finite range"),
        (np.ones((8, MAX_DRIVERS + 1)), -1.0, 1.0, f"1 to {MAX_DRIVERS} are planned for"),
        (np.ones((8, MAX_CHAIN_DRIVERS + 1)), -1.0, 1.0, "drivers move one finger"),
    ],
)
def test_drivers_that_no_kernel_has_room_or_use_for_are_refused(barrett, coupling, lower, upper, sentence):
    hand = np.rec.array(np.array([barrett.arrays]))[0]
    drivers = coupling.shape[1]
    with pytest.raises(HandError, match=sentence):
        set_drivers(hand, coupling, np.zeros(8), np.full(drivers, lower), np.full(drivers, upper))


@given(seed=seeds)
def test_sliding_step_is_the_gradient_without_its_part_along_the_normals(barrett, seed):
    """Unknowns: drivers and palm twist, lengths over LENGTH; pads may move within the tangent planes only."""
    rng = np.random.default_rng(seed)
    hand = coupled(barrett, AS_BUILT, np.zeros(8))
    state, work = random_state(hand, rng), new_work()
    sliding_step(hand, SETTINGS.for_kernels(), tuple(CENTER.tolist()), state, work, 0.5)
    V, drivers = work.step.twist, work.step.driver_step[:4]
    found = np.concatenate([drivers, -V[:3] / LENGTH, -V[3:]])
    assert np.linalg.norm(found) == pytest.approx(0.5)
    motions = []
    for finger in range(3):
        arm = state.pads[finger] - CENTER
        turning = -np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        J = driver_jacobians(hand, state.jacobians)[finger]
        motions.append(np.hstack([J, LENGTH * np.eye(3), turning]))  # of the pad, by the unknowns
    by_contacts, by_drivers = gradients(hand, state)
    g = np.concatenate([by_drivers, np.zeros(6)]) + np.vstack(motions).T @ by_contacts
    R = np.array([state.normals[finger] @ motions[finger] for finger in range(3)])
    dense = g - R.T @ np.linalg.solve(R @ R.T, R @ g)
    np.testing.assert_allclose(found, 0.5 * dense / np.linalg.norm(dense), atol=1e-10)
    np.testing.assert_allclose(R @ found, 0, atol=1e-12)


def test_contacts_slide_where_a_finger_has_fewer_than_two_drivers(barrett):
    few = coupled(barrett, AS_BUILT, np.zeros(8))
    for setting, expected in ((0, (False, False)), (1, (True, False)), (2, (True, True))):
        settings = PlannerSettings(palm_sliding=setting).for_kernels()
        assert (slides(few, settings), slides(barrett.arrays, settings)) == expected
    assert PlannerSettings.of("paper").palm_sliding == 0
