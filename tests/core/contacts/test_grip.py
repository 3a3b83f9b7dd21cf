"""The grip force: balanced in itself, inside cones and torques, and no larger than needed."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from fingersplit.contacts import grip as grip_module
from fingersplit.contacts.grip import GripProblem, least_grip
from fingersplit.contacts.linear_program import maximum
from fingersplit.hands.limits import MAX_CHAIN_JOINTS, MAX_DRIVERS, MAX_FINGERS

MIN_FORCE = 1.0


def ring(friction: float = 0.5, load: float = 5.0, torque: float = 1.0, angles=(0.1, 2.2, 4.3)) -> GripProblem:
    """Three fingers about a disc of 4 cm radius that is pulled from six sides; each moves its tip in all directions."""
    normals = np.array([[np.cos(a), np.sin(a), 0.0] for a in angles])
    jacobians = np.zeros((3, 3, 9))
    for finger in range(3):
        jacobians[finger, :, 3 * finger : 3 * finger + 3] = 0.1 * np.eye(3)
    loads = load * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    return GripProblem(
        contacts=0.04 * normals,
        normals=normals,
        jacobians=jacobians,
        torque_limits=np.full(9, torque),
        center_of_mass=np.zeros(3),
        friction=friction,
        least_forces=np.full(3, MIN_FORCE),
        loads=loads,
    )


@given(
    st.floats(0.3, 1.0), st.floats(0.0, 20.0), st.tuples(st.floats(0, 0.3), st.floats(1.8, 2.4), st.floats(3.9, 4.5))
)
def test_grip_is_balanced_and_presses(friction, load, angles):
    problem = ring(friction, load, 10.0, angles)
    grip = least_grip(problem)
    np.testing.assert_allclose(grip.forces.sum(axis=0), 0, atol=1e-8)
    np.testing.assert_allclose(np.cross(problem.contacts, grip.forces).sum(axis=0), 0, atol=1e-8)
    pressing = -(problem.normals * grip.forces).sum(axis=1)
    assert pressing.min() >= MIN_FORCE - 1e-6
    along = np.linalg.norm(grip.forces + pressing[:, None] * problem.normals, axis=1)
    assert (along <= friction * pressing / np.cos(np.pi / 8) + grip.violation + 1e-6).all()


def test_no_load_takes_the_least_force_and_more_load_takes_more():
    forces = [np.linalg.norm(least_grip(ring(load=load, torque=10.0)).forces, axis=1).max() for load in (0, 10, 20)]
    assert forces[0] == pytest.approx(MIN_FORCE, rel=0.1)
    assert forces[0] < forces[1] < forces[2]


def test_weight_is_carried_by_friction_alone_as_in_closed_form():
    """A load across the disc's plane is shared by three fingers: each needs load / (3 friction) of normal force."""
    problem = ring(friction=0.5, torque=10.0, angles=(0.0, 2 * np.pi / 3, 4 * np.pi / 3))
    grip = least_grip(replace(problem, loads=np.array([[0.0, 0.0, -30.0]])))
    np.testing.assert_allclose(np.linalg.norm(grip.forces, axis=1), 20.0, rtol=1e-6)
    assert grip.violation == pytest.approx(0, abs=1e-9)
    slippery = least_grip(replace(problem, friction=0.25, loads=np.array([[0.0, 0.0, -30.0]])))
    np.testing.assert_allclose(np.linalg.norm(slippery.forces, axis=1), 40.0, rtol=1e-6)


def test_torque_limits_cap_the_grip_and_the_violation_says_what_is_missing():
    free, capped = least_grip(ring(load=30.0, torque=10.0)), least_grip(ring(load=30.0, torque=1.0))
    assert free.violation == pytest.approx(0, abs=1e-9)
    assert (free.limited, capped.limited) == (False, True)
    assert capped.violation > 1.0
    assert np.abs(0.1 * capped.forces).max() <= 1.0


def test_contacts_that_no_grip_keeps_inside_their_cones_are_pressed_all_the_same():
    """On one side of a disc the lines between fingertips run along its surface rather than into it."""
    problem = ring(friction=0.1, load=0.0, torque=10.0, angles=(0.0, 0.8, 1.6))
    grip = least_grip(problem)
    assert -(problem.normals * grip.forces).sum(axis=1).max() >= MIN_FORCE - 1e-6
    assert grip.violation > 0.1
    assert not grip.limited


def anywhere(rng: np.random.Generator, fingers: int) -> GripProblem:
    """Contacts anywhere on a ball, a hand with as many joints as there is room for, often too little torque."""
    normals = rng.normal(size=(fingers, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    joints = min(MAX_CHAIN_JOINTS, MAX_DRIVERS // fingers)
    jacobians = np.zeros((fingers, 3, fingers, joints))
    for finger in range(fingers):
        jacobians[finger, :, finger] = rng.normal(scale=0.06, size=(3, joints))
    return GripProblem(
        contacts=0.04 * normals,
        normals=normals,
        jacobians=jacobians.reshape(fingers, 3, -1),
        torque_limits=np.full(fingers * joints, rng.choice([0.1, 0.5, 2.0])),
        center_of_mass=rng.normal(scale=0.005, size=3),
        friction=float(rng.choice([0.05, 0.3, 0.5, 0.8])),
        least_forces=np.full(fingers, rng.choice([0.0, 1.0, 3.0])),
        loads=rng.uniform(0.0, 30.0) * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)]),
    )


@given(st.integers(0, 2**32 - 1), st.integers(2, MAX_FINGERS))
def test_linear_program_of_the_grip_is_solved_as_by_scipy(seed, fingers):
    """Up to the largest hand; five fingers have more pairs than internal forces, so its columns are dependent."""
    programs = []

    def solve(c, A, b):
        x = maximum(c, A, b)
        programs.append((c, A, b, x))
        return x

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grip_module, "maximum", solve)
        least_grip(anywhere(np.random.default_rng(seed), fingers))
    ((c, A, b, x),) = programs
    exact = linprog(-c, A, b, bounds=(None, None), method="highs")
    assert exact.status == 0
    assert (A @ x - b).max() < 1e-7
    assert c @ x == pytest.approx(-exact.fun, abs=1e-5 * max(1.0, abs(exact.fun)))
