"""Small linear programs inside kernels: a primal-dual interior-point method on dense arrays [Mehrotra1992]."""

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.contacts.cone_kernel import FACETS
from fingersplit.hands.limits import MAX_CHAIN_DRIVERS, MAX_DRIVERS, MAX_FINGERS
from fingersplit.vectors_kernel import factorize, substitute

__all__ = ["LINEAR_PROGRAM", "MAX_ROWS", "MAX_VARIABLES", "maximize"]

_PAIRS = MAX_FINGERS * (MAX_FINGERS - 1) // 2
_HOLDING = MAX_FINGERS * (FACETS + 2 + 2 * MAX_CHAIN_DRIVERS), 3 * MAX_FINGERS - 6 + 1
_GRIP = MAX_FINGERS * (2 * FACETS + 5) + 2 * MAX_DRIVERS + 4, _PAIRS + 4 + MAX_FINGERS
MAX_ROWS, MAX_VARIABLES = max(_HOLDING[0], _GRIP[0]), max(_HOLDING[1], _GRIP[1])
"""Most inequalities and variables, for the largest hand: of ``holding_kernel`` (facets, largest and pressing force,
and both ways the torque of every driver, finger by finger) and of ``grip`` (two rows a facet, five bounds a finger,
both ways the torque of every driver of the hand, slacks)."""

LINEAR_PROGRAM = np.dtype(
    [
        ("w", np.float64, MAX_ROWS),
        ("z", np.float64, MAX_ROWS),
        ("dw", np.float64, MAX_ROWS),
        ("dz", np.float64, MAX_ROWS),
        ("primal", np.float64, MAX_ROWS),
        ("target", np.float64, MAX_ROWS),
        ("dual", np.float64, MAX_VARIABLES),
        ("matrix", np.float64, (MAX_VARIABLES, MAX_VARIABLES)),
        ("column", np.float64, (MAX_VARIABLES, 1)),
        ("A", np.float64, (MAX_ROWS, MAX_VARIABLES)),
        ("b", np.float64, MAX_ROWS),
        ("c", np.float64, MAX_VARIABLES),
        ("x", np.float64, MAX_VARIABLES),
    ],
    align=True,
)
"""A linear program, its solution ``x``, and the memory that ``maximize`` works in."""

ITERATIONS = 40
TOLERANCE = 1e-7
STEP_SHARE = 0.99
"""Of the way to the nearest bound that one step goes."""


@kernel
def maximize(c, A, b, rows, columns, x, scratch):
    """Maximise c . x subject to A x <= b.

    Newton's method on A x + w = b, A^T z = c, w z = mu with w, z >= 0: a predictor step for mu = 0, then a corrector
    with the mu that the predictor's success suggests. Both are solved with one factor of A^T (z / w) A.

    Args:
        c: Objective, (columns,).
        A: Left-hand sides, of full column rank, (rows, columns).
        b: Right-hand sides, of order one, (rows,).
        rows: Inequalities in use.
        columns: Variables in use.
        x: Gets the solution, (columns,).
        scratch: ``LINEAR_PROGRAM`` record to work in.

    Returns:
        Whether it converged; an infeasible or unbounded problem does not.
    """
    w, z, dw, dz = scratch.w, scratch.z, scratch.dw, scratch.dz
    steepest = 1.0
    for j in range(columns):
        x[j], steepest = 0.0, max(steepest, abs(c[j]))
    for i in range(rows):
        w[i], z[i] = max(abs(b[i]), 1.0), steepest
    for _ in range(ITERATIONS):
        gap, primal, dual = 0.0, 0.0, 0.0
        for i in range(rows):
            left = b[i] - w[i]
            for j in range(columns):
                left -= A[i, j] * x[j]
            scratch.primal[i] = left
            primal = max(primal, abs(left))
            gap += w[i] * z[i] / rows
        for j in range(columns):
            left = c[j]
            for i in range(rows):
                left -= A[i, j] * z[i]
            scratch.dual[j] = left
            dual = max(dual, abs(left))
        if max(gap, primal, dual) < TOLERANCE:
            return True
        _factorize(A, rows, columns, scratch)
        _direction(A, rows, columns, 0.0, False, scratch)
        longest = min(_longest(w, dw, rows), _longest(z, dz, rows))
        after = 0.0
        for i in range(rows):
            after += (w[i] + longest * dw[i]) * (z[i] + longest * dz[i]) / rows
        _direction(A, rows, columns, (after / gap) ** 3 * gap, True, scratch)
        forward = min(1.0, STEP_SHARE * _longest(w, dw, rows))
        sideward = min(1.0, STEP_SHARE * _longest(z, dz, rows))
        for j in range(columns):
            x[j] += forward * scratch.column[j, 0]
        for i in range(rows):
            w[i] += forward * dw[i]
            z[i] += sideward * dz[i]
    return False


@kernel
def _factorize(A, rows, columns, scratch):
    """Write the Cholesky factor of A^T (z / w) A, which predictor and corrector share, into ``matrix``."""
    M = scratch.matrix
    for j in range(columns):
        for k in range(j + 1):
            M[j, k] = 0.0
    for i in range(rows):
        weight = scratch.z[i] / scratch.w[i]
        for j in range(columns):
            for k in range(j + 1):
                M[j, k] += weight * A[i, j] * A[i, k]
    factorize(M, columns)


@kernel
def _direction(A, rows, columns, mu, corrected, scratch):
    """Newton step (dx, dw, dz) towards complementarity ``mu``; ``corrected`` by the products of the step before."""
    B, w, z = scratch.column, scratch.w, scratch.z
    for j in range(columns):
        B[j, 0] = scratch.dual[j]
    for i in range(rows):
        target = mu - w[i] * z[i] - (scratch.dw[i] * scratch.dz[i] if corrected else 0.0)
        scratch.target[i] = target
        pull = (target - z[i] * scratch.primal[i]) / w[i]
        for j in range(columns):
            B[j, 0] -= A[i, j] * pull  # dz = (target - z dw) / w with dw = primal - A dx, put into A^T dz = dual
    substitute(scratch.matrix, B, columns)
    for i in range(rows):
        moved = scratch.primal[i]
        for j in range(columns):
            moved -= A[i, j] * B[j, 0]
        scratch.dw[i] = moved
        scratch.dz[i] = (scratch.target[i] - z[i] * moved) / w[i]


@kernel
def _longest(values, steps, rows):
    """Largest step length that keeps all values positive, at most 1 / STEP_SHARE."""
    longest = 1.0 / STEP_SHARE
    for i in range(rows):
        if steps[i] < 0.0:
            longest = min(longest, -values[i] / steps[i])
    return longest
