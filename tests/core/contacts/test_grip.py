"""The grip force: balanced in itself, inside cones and torques, and no larger than needed."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from fingersplit.contacts.cones import facet_directions
from fingersplit.contacts.grasp_matrix import grasp_matrix
from fingersplit.contacts.grip import GripProblem, least_grip
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
    grip = least_grip(problem._replace(loads=np.array([[0.0, 0.0, -30.0]])))
    np.testing.assert_allclose(np.linalg.norm(grip.forces, axis=1), 20.0, rtol=1e-6)
    assert grip.violation == pytest.approx(0, abs=1e-9)
    slippery = least_grip(problem._replace(friction=0.25, loads=np.array([[0.0, 0.0, -30.0]])))
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
        torque_limits=np.outer(rng.choice([0.1, 0.5, 2.0]) * rng.choice([0.4, 1.0], size=2), np.ones(fingers * joints)),
        center_of_mass=rng.normal(scale=0.005, size=3),
        friction=float(rng.choice([0.05, 0.3, 0.5, 0.8])),
        least_forces=np.full(fingers, rng.choice([0.0, 1.0, 3.0])),
        loads=rng.uniform(0.0, 30.0) * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)]),
    )


@given(st.integers(0, 2**32 - 1), st.integers(2, MAX_FINGERS))
def test_least_grip_is_that_of_scipy(seed, fingers):
    """Up to the largest hand; five fingers have more pairs than internal forces, so its columns are dependent."""
    rng = np.random.default_rng(seed)
    limits = {"max_force": float(rng.choice([np.inf, 8.0, 30.0])), "min_share": float(rng.choice([0.0, 0.15]))}
    problem = anywhere(rng, fingers)._replace(**limits)
    grip = least_grip(problem)
    costs, A, b = program(problem)
    exact = linprog(costs, A, b, bounds=(None, None), method="highs")
    assert exact.status == 0
    P = len(grip.pulls)
    found = np.concatenate([grip.pulls, np.zeros(len(costs) - P)])
    for k in (0, 1, 2, *range(4, len(costs) - P), 3):  # the least that each needs; a share counts by the largest force
        needs = A[:, P + k] == -1
        found[P + k] = max(0.0, (A @ found - b)[needs].max(initial=0.0))
    assert (A @ found - b).max() < 1e-5 * max(1.0, np.abs(b).max())
    assert costs @ found == pytest.approx(exact.fun, rel=1e-4, abs=1e-3)
    assert grip.violation == pytest.approx(found[P + 1], abs=1e-3)


def program(problem: GripProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The grip's program as arrays: pulls, largest force, violation, lack, shortage, tangential forces."""
    fingers, pairs = len(problem.contacts), list(combinations(range(len(problem.contacts)), 2))
    unit = np.zeros((len(pairs), fingers, 3))
    for row, (a, b) in zip(unit, pairs, strict=True):
        row[a] = (problem.contacts[b] - problem.contacts[a]) / np.linalg.norm(problem.contacts[b] - problem.contacts[a])
        row[b] = -row[a]
    G = grasp_matrix(problem.contacts, problem.center_of_mass)
    wrenches = np.hstack([-problem.loads, np.zeros_like(problem.loads)])
    shares = (wrenches @ np.linalg.pinv(G).T).reshape(len(wrenches), -1, 3)
    columns, P = len(pairs) + 4 + fingers, len(pairs)
    rows, bounds = [], []

    def add(pull, bound, **slacks):
        row = np.zeros(columns)
        row[:P] = pull
        for name, value in slacks.items():
            row[P + int(name[1:])] = value
        rows.append(row)
        bounds.append(bound)

    for f, normal in enumerate(problem.normals):
        for across in facet_directions(problem.normals)[f]:
            add(
                unit[:, f] @ (across + problem.friction * normal),
                -(shares[:, f] @ (across + problem.friction * normal)).max(),
                _1=-1,
            )
            add(unit[:, f] @ across, 0, **{f"_{4 + f}": -1})
        add(-unit[:, f] @ normal, 0, _0=-1)
        add(unit[:, f] @ normal, -problem.least_forces[f], _2=-1)
        if problem.min_share:
            add(unit[:, f] @ normal, 0, _0=problem.min_share, _3=-1)
        if np.isfinite(problem.max_force):
            room = problem.max_force + (shares[:, f] @ normal).min()
            add(-unit[:, f] @ normal, max(room, 0.1 * problem.max_force))
    for k in range(4 + fingers):
        add(0, 0, **{f"_{k}": -1})
    for a in range(problem.jacobians.shape[2]):
        pulled = np.einsum("fk,pfk->p", problem.jacobians[:, :, a], unit)
        loaded = np.abs(np.einsum("fk,lfk->l", problem.jacobians[:, :, a], shares)).max()
        for sign, limit in zip((1, -1), problem.torque_limits[:, a], strict=True):
            add(sign * pulled / limit, max(1 - loaded / limit, 0.1))
    costs = np.concatenate([np.zeros(P), [1.0, 100.0, 1000.0, 20.0], np.ones(fingers)])
    return costs, np.array(rows), np.array(bounds)
