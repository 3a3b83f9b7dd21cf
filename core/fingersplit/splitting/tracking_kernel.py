"""The nonlinear projection that CPO and PPO share: joints that follow a fingertip displacement within their limits."""

from fingersplit.compilation import kernel
from fingersplit.vectors_kernel import add, dot, scale, solve_positive_definite

__all__ = ["STATIONARY", "at_limit", "track"]

DAMPING = 1e-3
"""[m/rad]; two percent of a short finger's reach, so a straight finger does not run away."""

ACTIVE_SET_ROUNDS = 12
"""More than the four joints of a finger ever need."""

MIN_PULL_BACK = 1e-15
"""[m^2/rad]; rounding, not a pull."""

STATIONARY = 1e-9
"""A tangent step this much shorter than the gradient is rounding: there is no way to go."""

LIMIT_MARGIN = 1e-9
"""[rad]; closer than this a joint counts as standing at its limit."""


@kernel
def at_limit(hand, joints, j, direction):
    """Whether joint ``j`` stands at the limit that a motion of this sign would push it through."""
    if direction > 0.0:
        return joints[j] >= hand.upper[j] - LIMIT_MARGIN
    return direction < 0.0 and joints[j] <= hand.lower[j] + LIMIT_MARGIN


@kernel
def track(hand, pose, finger, displacement, solver, joints):
    """Move one finger's joints so that its pad follows ``displacement`` (3,) [m], as J^-1 in [Fan2018] does.

    Minimises |J d_q - displacement|^2 + DAMPING^2 |d_q|^2 with the joint limits as bounds. Writes the new angles to
    ``joints`` (N,) [rad], which must not be ``pose.joints``.
    """
    count, indices, steps = hand.joint_counts[finger], hand.joint_indices[finger], solver.steps
    for i in range(count):
        solver.lowest[i] = hand.lower[indices[i]] - pose.joints[indices[i]]
        solver.highest[i] = hand.upper[indices[i]] - pose.joints[indices[i]]
    _bounded_least_squares(pose.jacobians[finger], count, displacement, solver)
    for i in range(count):
        j = indices[i]
        joints[j] = min(max(pose.joints[j] + steps[i], hand.lower[j]), hand.upper[j])


@kernel
def _bounded_least_squares(J, count, target, solver):
    """The ``count`` steps within bounds that minimise |J steps - target|^2 + DAMPING^2 |steps|^2, by an active set.

    A step that would cross its bound is held there, and one that is held but pulled back inside is let go. Bounds and
    steps are those of ``solver``, a ``SOLVER_WORK`` record.
    """
    for i in range(count):
        solver.frozen[i] = False
    for _ in range(ACTIVE_SET_ROUNDS):
        _solve_free_steps(J, count, target, solver)
        if _hold_worst(count, solver):
            continue
        if not _let_go(J, count, target, solver):
            return


@kernel
def _solve_free_steps(J, count, target, solver):
    """Steps that are not held, given those that are, into ``columns[:, 0]``."""
    held, matrix, columns, steps = solver.frozen, solver.matrix, solver.columns, solver.steps
    for i in range(count):
        columns[i, 0], columns[i, 1] = 0.0, 0.0
        for j in range(count):
            matrix[i, j] = DAMPING * DAMPING if i == j else 0.0
        if held[i]:
            continue
        for k in range(3):
            columns[i, 0] += J[k, i] * target[k]
        for j in range(count):
            entry = J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j]
            if held[j]:
                columns[i, 0] -= entry * steps[j]
            else:
                matrix[i, j] += entry
    solve_positive_definite(matrix, columns, count)


@kernel
def _hold_worst(count, solver):
    """Cut the free steps to their bounds and hold the one that was cut most; whether any was."""
    held, columns, steps = solver.frozen, solver.columns, solver.steps
    worst, worst_excess = -1, 0.0
    for i in range(count):
        if not held[i]:
            steps[i] = min(max(columns[i, 0], solver.lowest[i]), solver.highest[i])
            if abs(columns[i, 0] - steps[i]) > worst_excess:
                worst, worst_excess = i, abs(columns[i, 0] - steps[i])
    if worst >= 0:
        held[worst] = True
    return worst >= 0


@kernel
def _let_go(J, count, target, solver):
    """Free the held step that the objective pulls back inside most strongly; whether there was one."""
    held, steps, gap = solver.frozen, solver.steps, scale(-1.0, target)
    for i in range(count):
        gap = add(gap, scale(steps[i], (J[0, i], J[1, i], J[2, i])))
    strongest, strongest_pull = -1, MIN_PULL_BACK
    for i in range(count):
        if held[i]:
            slope = dot((J[0, i], J[1, i], J[2, i]), gap) + DAMPING * DAMPING * steps[i]
            pull = slope if steps[i] >= solver.highest[i] else -slope
            if pull > strongest_pull:
                strongest, strongest_pull = i, pull
    if strongest >= 0:
        held[strongest] = False
    return strongest >= 0
