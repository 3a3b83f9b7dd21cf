"""The small linear algebra of the kernels against NumPy and SciPy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.vectors_kernel import (
    add,
    angle_between,
    column,
    cross,
    dot,
    get,
    multiply,
    norm,
    put,
    rotate,
    rotate_back,
    scale,
    set_rotation_about,
    solve_positive_definite,
    subtract,
)
from fingersplit.vectors_kernel import vector as vector_of

coordinate = st.floats(-10, 10, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 1e-6)
vector = st.tuples(coordinate, coordinate, coordinate)
seeds = st.integers(0, 2**32 - 1)


@given(vector, vector, coordinate)
def test_vector_operations_are_those_of_numpy(a, b, s):
    assert add(a, b) == pytest.approx(np.add(a, b))
    assert subtract(a, b) == pytest.approx(np.subtract(a, b))
    assert scale(s, a) == pytest.approx(np.multiply(s, a))
    assert dot(a, b) == pytest.approx(np.dot(a, b), abs=1e-12)
    assert cross(a, b) == pytest.approx(np.cross(a, b), abs=1e-12)
    assert norm(a) == pytest.approx(np.linalg.norm(a))


@given(seeds)
def test_matrix_operations_are_those_of_numpy(seed):
    rng = np.random.default_rng(seed)
    A, B, v, out = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), tuple(rng.normal(size=3)), np.empty((3, 3))
    multiply(A, B, out)
    np.testing.assert_allclose(out, A @ B, atol=1e-14)
    np.testing.assert_allclose(rotate(A, v), A @ v, atol=1e-14)
    np.testing.assert_allclose(rotate_back(A, v), A.T @ v, atol=1e-14)


def test_rows_columns_and_arrays_become_vectors_and_back():
    rows = np.arange(12.0).reshape(4, 3)
    assert get(rows, 2) == (6.0, 7.0, 8.0)
    assert column(rows[:3], 1) == (1.0, 4.0, 7.0)
    assert vector_of(rows[3]) == (9.0, 10.0, 11.0)
    put(rows, 0, (-1.0, -2.0, -3.0))
    np.testing.assert_array_equal(rows[:2], [[-1, -2, -3], [3, 4, 5]])


@given(seeds, st.floats(-10, 10))
def test_rotation_about_an_axis_is_that_of_scipy(seed, angle):
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    rotation = np.empty((3, 3))
    set_rotation_about(tuple(axis), angle, rotation)
    np.testing.assert_allclose(rotation, Rotation.from_rotvec(angle * axis).as_matrix(), atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-4, 0.6, math.pi / 2, math.pi - 1e-9, math.pi])
def test_angle_is_exact_where_its_cosine_is_flat(angle):
    a, b = (2.0, 0.0, 0.0), (3 * math.cos(angle), 3 * math.sin(angle), 0.0)
    assert angle_between(a, b) == pytest.approx(angle, rel=1e-12, abs=1e-15)


@given(seeds, st.integers(1, 9))
def test_positive_definite_solution_is_that_of_numpy(seed, n):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    A, B = root @ root.T + 0.1 * np.eye(n), rng.normal(size=(n, 2))
    spare = rng.normal(size=(n + 2, n + 2))  # the block stands in a larger work array
    spare[:n, :n] = A
    columns = np.vstack([B, np.full((2, 2), 7.0)])
    solve_positive_definite(spare, columns, n)
    np.testing.assert_allclose(columns[:n], np.linalg.solve(A, B), rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(columns[n:], 7.0)


@given(seeds, st.integers(2, 9), st.integers(1, 8))
def test_rows_without_rank_get_zero_and_the_others_still_solve(seed, n, rank):
    rank = min(rank, n - 1)
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, rank))
    A = root @ root.T
    B = A @ rng.normal(size=(n, 2))
    X = B.copy()
    solve_positive_definite(A.copy(), X, n)
    assert (X[rank:] == 0).all()
    np.testing.assert_allclose(A @ X, B, atol=1e-6 * np.abs(B).max())
