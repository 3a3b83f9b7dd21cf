"""The tangent step of CPO where drivers move several fingers: eq. (4) of [Fan2018] for all fingers in one system."""

from fingersplit.compilation import kernel
from fingersplit.splitting.tracking_kernel import at_limit
from fingersplit.vectors_kernel import get, solve_positive_definite

__all__ = ["step_together"]


@kernel
def step_together(hand, state, work):
    """d_0 into ``work.step``: its ``driver_step`` and ``contact_step``, before scaling.

    Minimises sum_f |J_f d - g_c,f|^2 + |d - g_theta|^2 subject to n_f^T J_f d = 0 for every finger, by
    H d = b - C^T lambda with H = I + sum_f J_f^T J_f and the rows n_f^T J_f as C. A driver at its limit and pushed
    outwards leaves the active set and the problem is solved again.
    """
    count, frozen, step = hand.driver_count, work.solver.frozen, work.step
    for a in range(count):
        frozen[a] = False
    for _ in range(count + 1):
        _solve(hand, state, work)
        changed = False
        for a in range(count):
            if not frozen[a] and at_limit(hand, state.drivers, a, step.driver_step[a]):
                frozen[a], changed = True, True
        if not changed:
            break
    for finger in range(hand.finger_count):
        for k in range(3):
            step.contact_step[finger, k] = 0.0
            for i in range(hand.driver_counts[finger]):
                motion = state.jacobians[finger, k, i]
                step.contact_step[finger, k] += motion * step.driver_step[hand.driver_indices[finger, i]]


@kernel
def _solve(hand, state, work):
    """``driver_step`` of the drivers that are not frozen, zero for the others."""
    solver, step, count, fingers = work.solver, work.step, hand.driver_count, hand.finger_count
    H, B = solver.matrix, solver.constraints  # columns of B: b, then the rows of C
    for a in range(count):
        for c in range(count):
            H[a, c] = 1.0 if a == c else 0.0
        B[a, 0] = 0.0 if solver.frozen[a] else step.driver_gradient[a]
        for f in range(fingers):
            B[a, 1 + f] = 0.0
    for f in range(fingers):
        J, n, g = state.jacobians[f], get(state.normals, f), get(step.contact_gradient, f)
        for i in range(hand.driver_counts[f]):
            a = hand.driver_indices[f, i]
            if solver.frozen[a]:
                continue
            B[a, 0] += J[0, i] * g[0] + J[1, i] * g[1] + J[2, i] * g[2]
            B[a, 1 + f] = J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]
            for k in range(hand.driver_counts[f]):
                c = hand.driver_indices[f, k]
                if not solver.frozen[c]:
                    H[a, c] += J[0, i] * J[0, k] + J[1, i] * J[1, k] + J[2, i] * J[2, k]
    solve_positive_definite(H, B, count)
    L, m = solver.multipliers, solver.multiplier
    for f in range(fingers):
        m[f, 0] = _along(hand, state, f, B, 0, solver.frozen)
        for g in range(fingers):
            L[f, g] = _along(hand, state, f, B, 1 + g, solver.frozen)
    solve_positive_definite(L, m, fingers)
    for a in range(count):
        step.driver_step[a] = 0.0
        if not solver.frozen[a]:
            step.driver_step[a] = B[a, 0]
            for f in range(fingers):
                step.driver_step[a] -= m[f, 0] * B[a, 1 + f]


@kernel
def _along(hand, state, f, B, column, frozen):
    """n_f^T J_f times a column of B."""
    J, n, total = state.jacobians[f], get(state.normals, f), 0.0
    for i in range(hand.driver_counts[f]):
        a = hand.driver_indices[f, i]
        if not frozen[a]:
            total += (J[0, i] * n[0] + J[1, i] * n[1] + J[2, i] * n[2]) * B[a, column]
    return total
