"""Least squares within bounds, small and dense: an active set on the normal equations."""

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import solve_positive_definite

__all__ = ["solve_bounded"]

ROUNDS_PER_UNKNOWN = 3
"""Changes of the active set, more than a finger ever needs."""

MIN_PULL_BACK = 1e-15
"""[m^2/rad]; rounding, not a pull."""


@kernel
def solve_bounded(count, solver):
    """The ``count`` steps x within bounds that minimise x^T H x / 2 - b^T x.

    A step that would cross its bound is held there, and one that is held but pulled back inside is let go. H, b, the
    bounds and the steps are ``normal``, ``right``, ``lowest``, ``highest`` and ``steps`` of ``solver``, a
    ``SOLVER_WORK`` record.
    """
    for i in range(count):
        solver.frozen[i] = False
    for _ in range(ROUNDS_PER_UNKNOWN * count):
        _solve_free_steps(count, solver)
        if _hold_worst(count, solver):
            continue
        if not _let_go(count, solver):
            return


@kernel
def _solve_free_steps(count, solver):
    """Steps that are not held, given those that are, into ``column``."""
    held, matrix, column, normal = solver.frozen, solver.matrix, solver.column, solver.normal
    for i in range(count):
        column[i, 0] = 0.0
        for j in range(count):
            matrix[i, j] = 1.0 if i == j else 0.0
        if held[i]:
            continue
        column[i, 0] = solver.right[i]
        for j in range(count):
            if held[j]:
                column[i, 0] -= normal[i, j] * solver.steps[j]
            else:
                matrix[i, j] = normal[i, j]
    solve_positive_definite(matrix, column, count)


@kernel
def _hold_worst(count, solver):
    """Cut the free steps to their bounds and hold the one that was cut most; whether any was."""
    held, column, steps = solver.frozen, solver.column, solver.steps
    worst, worst_excess = -1, 0.0
    for i in range(count):
        if not held[i]:
            steps[i] = min(max(column[i, 0], solver.lowest[i]), solver.highest[i])
            if abs(column[i, 0] - steps[i]) > worst_excess:
                worst, worst_excess = i, abs(column[i, 0] - steps[i])
    if worst >= 0:
        held[worst] = True
    return worst >= 0


@kernel
def _let_go(count, solver):
    """Free the held step that the objective pulls back inside most strongly; whether there was one."""
    held, steps = solver.frozen, solver.steps
    strongest, strongest_pull = -1, MIN_PULL_BACK
    for i in range(count):
        if held[i]:
            slope = -solver.right[i]
            for j in range(count):
                slope += solver.normal[i, j] * steps[j]
            pull = slope if steps[i] >= solver.highest[i] else -slope
            if pull > strongest_pull:
                strongest, strongest_pull = i, pull
    if strongest >= 0:
        held[strongest] = False
    return strongest >= 0
