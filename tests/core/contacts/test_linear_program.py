"""The small linear programs against SciPy's solver."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from fingersplit.contacts.linear_program_kernel import LINEAR_PROGRAM, MAX_ROWS, MAX_VARIABLES, maximize

seeds = st.integers(0, 2**32 - 1)
columns = st.integers(1, MAX_VARIABLES)


def solve(c: np.ndarray, A: np.ndarray, b: np.ndarray) -> tuple[bool, np.ndarray]:
    """Whether it converged, and the solution; arrays have room to spare as the planner's do."""
    rows, n = A.shape
    wide, right, x = np.full((MAX_ROWS, MAX_VARIABLES), np.nan), np.full(MAX_ROWS, np.nan), np.full(n, np.nan)
    wide[:rows, :n], right[:rows] = A, b
    scratch = np.rec.array(np.zeros(1, LINEAR_PROGRAM))[0]
    return maximize(c, wide, right, rows, n, x, scratch), x


def bounded_program(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A box with a point inside it that random cuts leave in."""
    cuts = int(rng.integers(0, MAX_ROWS - 2 * n + 1))
    A = np.vstack([np.eye(n), -np.eye(n), rng.normal(size=(cuts, n))])
    inside = rng.uniform(-0.8, 0.8, n)
    b = np.concatenate([np.ones(2 * n), A[2 * n :] @ inside + rng.uniform(0.01, 1.0, cuts)])
    return rng.normal(size=n), A, b


def reference(c: np.ndarray, A: np.ndarray, b: np.ndarray):
    return linprog(-c, A_ub=A, b_ub=b, bounds=(None, None), method="highs")


@given(seeds, columns)
def test_optimum_is_that_of_scipy(seed, n):
    c, A, b = bounded_program(np.random.default_rng(seed), n)
    converged, x = solve(c, A, b)
    assert converged
    assert (A @ x - b).max() < 1e-6
    assert c @ x == pytest.approx(-reference(c, A, b).fun, abs=1e-5)


@given(seeds, columns)
def test_doubled_and_touching_inequalities_do_no_harm(seed, n):
    """Every cut twice, and one more that only just touches the optimum: degenerate corners."""
    c, A, b = bounded_program(np.random.default_rng(seed), n)
    A, b = A[: MAX_ROWS // 2 - 1], b[: MAX_ROWS // 2 - 1]
    best = -reference(c, A, b).fun
    A, b = np.vstack([A, A, c]), np.concatenate([b, b, [best]])
    converged, x = solve(c, A, b)
    assert converged
    assert (A @ x - b).max() < 1e-6
    assert c @ x == pytest.approx(best, abs=1e-5)


@given(seeds, columns, st.floats(0.01, 10))
def test_infeasible_is_said_to_be(seed, n, gap):
    """A sum of inequalities, each times a positive number, contradicted by ``gap``."""
    rng = np.random.default_rng(seed)
    c, A, b = bounded_program(rng, n)
    A, b = A[: MAX_ROWS - 1], b[: MAX_ROWS - 1]
    weights = rng.random(len(b))
    weights /= weights.sum()
    A, b = np.vstack([A, -weights @ A]), np.append(b, -weights @ b - gap)
    assert reference(c, A, b).status == 2
    assert not solve(c, A, b)[0]


@given(seeds, columns)
def test_unbounded_is_said_to_be(seed, n):
    """No inequality looks along a direction that the objective does."""
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=n)
    A = rng.normal(size=(3 * n, n))
    A -= np.outer(np.maximum(A @ direction, 0) + 0.1, direction) / (direction @ direction)
    c, b = direction + 0.1 * rng.normal(size=n), rng.uniform(0.1, 1, 3 * n)
    if c @ direction > 0:
        assert not solve(c, A, b)[0]


def test_a_triangle():
    """x + y is largest at (1, 2) of x <= 1, y <= 2, x + 2 y <= 5."""
    converged, x = solve(np.ones(2), np.array([[1, 0], [0, 1], [1, 2], [-1, -1.0]]), np.array([1, 2, 5, 5.0]))
    assert converged
    np.testing.assert_allclose(x, [1, 2], atol=1e-6)


def test_contradiction_in_one_variable():
    assert not solve(np.ones(1), np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0]))[0]  # x <= -1 and x >= 1


def test_nothing_above():
    assert not solve(np.ones(1), np.array([[-1.0], [-2.0]]), np.array([1.0, 1.0]))[0]
