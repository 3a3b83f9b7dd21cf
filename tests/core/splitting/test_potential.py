"""The potentials: their sum by its definition, their gradients by finite differences, and where they are silent."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from fingersplit.hands.kinematics_kernel import move_drivers
from fingersplit.splitting.collision_kernel import RANGE
from fingersplit.splitting.potential_kernel import add_penalty_gradient, penalty
from fingersplit.splitting.state import Problem, new_states, new_times, new_work
from fingersplit.splitting.state_kernel import evaluate, measure_collision
from fingersplit.transforms import pose_matrix

seeds = st.integers(0, 2**32 - 1)
WIDE = {"clearance_margin": RANGE, "soft_pad_angle": 0.1, "joint_limit_margin": 0.3}
"""Settings under which every potential acts on about half of the states."""
NAMES = ("box", "mug", "sphere")


@pytest.fixture(scope="module")
def near_state(barrett, runs_of) -> Callable[[np.random.Generator, str], np.record]:
    """A mapped start, its joints and palm disturbed, so that links are near the object or in it."""

    def disturb(rng: np.random.Generator, name: str) -> np.record:
        runs, states = runs_of(name), new_states(1)
        states[0] = runs[rng.integers(len(runs))].first
        state = states[0]
        joints = state.joints[:8] + rng.normal(scale=0.05, size=8)
        state.joints[:8] = state.drivers[:8] = np.clip(joints, barrett.lower, barrett.upper)
        state.palm_position += rng.normal(scale=rng.choice([2e-3, 20e-3]), size=3)
        return state

    return disturb


def measured(problem: Problem, state: np.record, joints=0.0, palm=None) -> np.record:
    """The same contacts with other joints (8,) and another palm (4, 4), all that depends on them up to date."""
    states = new_states(1)
    states[0] = state
    moved = states[0]
    moved.drivers[:8] += joints
    if palm is not None:
        moved.palm_rotation, moved.palm_position = palm[:3, :3], palm[:3, 3]
    move_drivers(problem.hand, moved)
    evaluate(problem.hand, problem.settings, moved)
    work = new_work()
    measure_collision(problem, moved, work, new_times().cpo)
    return moved


def palm_after(state: np.record, center: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Where the object sees the palm after it moved by a body twist about ``center`` itself."""
    velocity = np.zeros((4, 4))
    velocity[:3, :3] = [[0, -twist[5], twist[4]], [twist[5], 0, -twist[3]], [-twist[4], twist[3], 0]]
    velocity[:3, 3] = twist[:3]
    to_center = pose_matrix(np.eye(3), -center)
    palm = pose_matrix(state.palm_rotation, state.palm_position)
    return np.linalg.inv(to_center) @ scipy.linalg.expm(-velocity) @ to_center @ palm


def gradient(problem: Problem, state: np.record) -> tuple[np.ndarray, np.ndarray]:
    """Of the penalty, by the joints (8,) and by the twist (6,)."""
    work = new_work()
    add_penalty_gradient(problem.hand, problem.settings, state, problem.center, work.step)
    return -work.step.driver_gradient[:8], -work.step.twist_gradient


def same_nearest_points(*states: np.record) -> bool:
    """Whether the links' nearest points of the object, and the faces nearest to those, are the same."""
    first, *others = states
    near = first.clearances < np.inf
    return all(
        np.array_equal(near, other.clearances < np.inf)
        and np.array_equal(first.clearance_points[near], other.clearance_points[near])
        and np.allclose(first.clearance_normals[near], other.clearance_normals[near], atol=1e-3)
        for other in others
    )


def slope(problem: Problem, states: list[np.record], step: float) -> float:
    ahead, behind = (penalty(problem.hand, problem.settings, state) for state in states)
    return (ahead - behind) / (2 * step)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(seed=seeds)
def test_gradient_agrees_with_finite_differences(problem_of, near_state, name, seed):
    problem = problem_of(name, **WIDE)
    state, step = measured(problem, near_state(np.random.default_rng(seed), name)), 1e-6
    by_joints, by_twist = gradient(problem, state)
    center = np.array(problem.center)
    for j, turn in enumerate(step * np.eye(8)):
        moved = [measured(problem, state, joints=sign * turn) for sign in (1, -1)]
        if same_nearest_points(state, *moved):
            assert by_joints[j] == pytest.approx(slope(problem, moved, step), rel=1e-3, abs=1e-6)
    for k, twist in enumerate(step * np.eye(6)):
        moved = [measured(problem, state, palm=palm_after(state, center, sign * twist)) for sign in (1, -1)]
        if same_nearest_points(state, *moved):
            assert by_twist[k] == pytest.approx(slope(problem, moved, step), rel=1e-3, abs=1e-6)


def test_differences_mostly_keep_the_nearest_points_and_links_of_every_kind_are_near(barrett, problem_of, near_state):
    kept, near = [], np.zeros(len(barrett.shape_names), int)
    for seed in range(120):
        name = NAMES[seed % len(NAMES)]
        problem = problem_of(name, **WIDE)
        state = measured(problem, near_state(np.random.default_rng(seed), name))
        kept += [same_nearest_points(state, measured(problem, state, joints=turn)) for turn in 1e-6 * np.eye(8)]
        near += state.clearances[: near.size] < RANGE
    assert np.mean(kept) > 0.9
    met = {shape for shape, count in zip(barrett.shape_names, near, strict=True) if count}
    assert {"knuckle", "proximal", "distal", "nose"} <= {shape.split("_")[-1] for shape in met}


@given(seed=seeds, name=st.sampled_from(NAMES))
def test_sum_is_that_of_the_definition(barrett, problem_of, near_state, seed, name):
    problem = problem_of(name, **WIDE)
    state, expected = measured(problem, near_state(np.random.default_rng(seed), name)), 0.0
    for k, shape in enumerate(barrett.shape_names):
        margin = 0.0 if shape.endswith(("_distal", "_nose")) else RANGE  # these carry the pads and may touch
        expected += 300.0 * max(margin - state.clearances[k], 0.0) ** 2
    expected += 0.1 * (np.maximum(state.pad_angles[:3] - 0.1, 0) ** 2).sum()
    share = (state.joints[:8] - barrett.lower) / (barrett.upper - barrett.lower)
    expected += 0.1 * (np.maximum(0.3 - np.minimum(share, 1 - share), 0) ** 2).sum()
    assert penalty(problem.hand, problem.settings, state) == pytest.approx(expected, rel=1e-9)
    assert state.merit == pytest.approx(state.quality - expected, rel=1e-9)


def aligned_state(barrett, posed_state, joints: np.ndarray, height: float) -> np.record:
    """A hand above the object whose pads face surface normals squarely."""
    state = posed_state(joints, pose_matrix(np.eye(3), (0, 0, height)))
    state.normals[:3] = -state.pad_normals[:3]
    state.contacts[:3] = state.pads[:3]
    return state


def test_nothing_pushes_far_from_all_limits(barrett, problem_of, posed_state):
    problem = problem_of("sphere")
    state = measured(problem, aligned_state(barrett, posed_state, (barrett.lower + barrett.upper) / 2, 1.0))
    assert penalty(problem.hand, problem.settings, state) == 0
    assert state.merit == state.quality
    by_joints, by_twist = gradient(problem, state)
    np.testing.assert_array_equal(by_joints, 0)
    np.testing.assert_array_equal(by_twist, 0)


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_joints_are_pushed_away_from_their_limits(barrett, problem_of, posed_state, end):
    problem, joints = problem_of("sphere"), (barrett.lower + barrett.upper) / 2
    joints[3] = getattr(barrett, end)[3]
    state = measured(problem, aligned_state(barrett, posed_state, joints, 1.0))
    assert penalty(problem.hand, problem.settings, state) == pytest.approx(0.1 * 0.05**2)
    by_joints, _ = gradient(problem, state)
    inwards = np.sign(by_joints[3]) == (1 if end == "upper" else -1)  # down the potential is back inside
    assert inwards
    assert (np.delete(by_joints, 3) == 0).all()


def test_palm_in_the_object_is_pushed_out(barrett, problem_of, posed_state):
    problem = problem_of("sphere")
    state = measured(problem, aligned_state(barrett, posed_state, np.full(8, 0.5), -0.11))
    assert state.penetration > 1e-3
    _, by_twist = gradient(problem, state)
    assert by_twist[2] < 0  # the object leaves the palm upwards


@given(seed=seeds)
def test_switched_off_potentials_do_not_push(problem_of, near_state, seed):
    problem = problem_of("mug", potentials=False)
    state = measured(problem, near_state(np.random.default_rng(seed), "mug"))
    assert penalty(problem.hand, problem.settings, state) == 0
    assert state.merit == state.quality
    assert not np.concatenate(gradient(problem, state)).any()


@pytest.mark.parametrize("name", ["mug", "box"])
def test_switched_off_potentials_play_no_part(runs_of, name):
    weights = {"clearance_weight": 0.0, "pad_angle_weight": 0.0, "joint_limit_weight": 0.0}
    for off, weightless in zip(
        runs_of(name, potentials=False), runs_of(name, potentials=False, **weights), strict=True
    ):
        np.testing.assert_array_equal(off.trace.joints, weightless.trace.joints)
        np.testing.assert_array_equal(off.last.contacts, weightless.last.contacts)
