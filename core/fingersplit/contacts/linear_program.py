"""Small linear programs from Python, by the kernels' own solver."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.linear_program_kernel import LINEAR_PROGRAM, MAX_ROWS, MAX_VARIABLES, maximize

__all__ = ["maximum"]


def maximum(c: NDArray[np.float64], A: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The x (n,) of largest c . x with A x <= b; None where it is infeasible or unbounded.

    Args:
        c: Objective, (n,), at most ``MAX_VARIABLES``.
        A: Left-hand sides, of full column rank, (m, n), at most ``MAX_ROWS`` rows.
        b: Right-hand sides, of order one, (m,).

    Raises:
        ValueError: More rows or variables than the solver has room for.
    """
    rows, columns = A.shape
    if rows > MAX_ROWS or columns > MAX_VARIABLES:
        raise ValueError(f"{rows} rows and {columns} variables; room for {MAX_ROWS} and {MAX_VARIABLES}.")
    x = np.empty(columns)
    scratch = np.zeros(1, LINEAR_PROGRAM)
    return x if maximize(c, np.ascontiguousarray(A), b, rows, columns, x, scratch[0]) else None
