"""The linear program of ``grip``: its rows, and from its solution to forces."""

from fingersplit.compilation import kernel
from fingersplit.contacts.cone_kernel import FACETS, facet, tangents
from fingersplit.contacts.linear_program_kernel import maximize
from fingersplit.vectors_kernel import add, dot, get, norm, put, scale, subtract

__all__ = ["GRIP_COLUMNS", "VIOLATION", "pull_fingers", "solve_grip"]

TANGENTIAL_COST, VIOLATION_COST, LACK_COST, SHORTAGE_COST = 1.0, 100.0, 1000.0, 20.0
"""What a newton along a surface, outside a friction cone, missing in pressing and missing in a finger's share of the
grip cost in newtons of grip."""
LARGEST, VIOLATION, LACK, SHORTAGE, GRIP_COLUMNS = range(5)
"""Unknowns after the pulls: largest normal force, violation, lack of pressing, shortage of a share; tangential force of
each finger follows."""
MIN_ROOM = 0.1
"""Share of a limit that is left for the grip however much of it the loads take."""


@kernel
def solve_grip(problem, shares, s):
    """Solve the program of a grip; whether it converged, and ``_write_program``'s answer.

    Args:
        problem: ``GripProblem``, with the friction of each finger.
        shares: Forces of the fingers that balance each load, (L, F, 3) [N].
        s: ``LINEAR_PROGRAM`` record; gets the program and its solution.
    """
    rows, torque_rows, unit = _write_program(problem, shares, s)
    fingers = len(problem.contacts)
    columns = fingers * (fingers - 1) // 2 + GRIP_COLUMNS + fingers
    return maximize(s.c, s.A, s.b, rows, columns, s.x, s), rows, torque_rows, unit


@kernel
def pull_fingers(contacts, pulls, forces):
    """Forces (F, 3) on the object, by the fingers at ``contacts`` (F, 3) [m], of ``pulls`` (P,) between them [N]."""
    forces[:] = 0.0
    pair = 0
    for a in range(len(contacts)):
        for b in range(a + 1, len(contacts)):
            direction = scale(pulls[pair], _pull_direction(contacts, a, b))
            put(forces, a, add(get(forces, a), direction))
            put(forces, b, subtract(get(forces, b), direction))
            pair += 1


@kernel
def _write_program(problem, shares, s):
    """Write the program into ``s``: maximise c . x subject to A x <= b; rows, those of torques at their end, unit [N].

    With the unit of force that is returned all right-hand sides are of order one.
    """
    fingers = len(problem.contacts)
    pulls = fingers * (fingers - 1) // 2
    row = _set_cone_rows(problem, shares, pulls, s)
    row = _set_bounds(problem, shares, pulls, row, s)
    unit = 1.0
    for i in range(row):
        unit = max(unit, abs(s.b[i]))
    for i in range(row):
        s.b[i] /= unit
    torque_rows = problem.torque_limits.size
    for a in range(problem.torque_limits.shape[1]):
        _set_torque_rows(problem, shares, a, pulls, unit, row + 2 * a, s)
    s.c[:] = 0.0
    s.c[pulls + LARGEST], s.c[pulls + VIOLATION] = -1.0, -VIOLATION_COST
    s.c[pulls + LACK], s.c[pulls + SHORTAGE] = -LACK_COST, -SHORTAGE_COST
    for f in range(fingers):
        s.c[pulls + GRIP_COLUMNS + f] = -TANGENTIAL_COST
    return row + torque_rows, torque_rows, unit


@kernel
def _set_cone_rows(problem, shares, pulls, s):
    """Forces with the share of any load inside the cones but for the violation, and the size of tangential parts."""
    row = 0
    for f in range(len(problem.contacts)):
        normal = get(problem.normals, f)
        first, second = tangents(scale(-1.0, normal))
        for k in range(FACETS):
            across = facet(first, second, k)
            outside = add(across, scale(problem.friction[f], normal))
            worst = dot(outside, get(shares[0], f))
            for load in range(1, len(shares)):
                worst = max(worst, dot(outside, get(shares[load], f)))
            _set_row(problem.contacts, f, outside, pulls, row, s)
            s.A[row, pulls + VIOLATION], s.b[row] = -1.0, -worst
            _set_row(problem.contacts, f, across, pulls, row + 1, s)
            s.A[row + 1, pulls + GRIP_COLUMNS + f], s.b[row + 1] = -1.0, 0.0
            row += 2
    return row


@kernel
def _set_bounds(problem, shares, pulls, row, s):
    """Bounds of the normal forces, and unknowns that are not negative."""
    fingers = len(problem.contacts)
    for f in range(fingers):
        normal = get(problem.normals, f)
        pressing = -dot(normal, get(shares[0], f))
        for load in range(1, len(shares)):
            pressing = max(pressing, -dot(normal, get(shares[load], f)))
        _set_row(problem.contacts, f, scale(-1.0, normal), pulls, row, s)
        s.A[row, pulls + LARGEST], s.b[row] = -1.0, 0.0
        _set_row(problem.contacts, f, normal, pulls, row + 1, s)
        s.A[row + 1, pulls + LACK], s.b[row + 1] = -1.0, -problem.least_forces[f]
        row += 2
        if problem.min_share > 0.0:
            _set_row(problem.contacts, f, normal, pulls, row, s)
            s.A[row, pulls + LARGEST], s.A[row, pulls + SHORTAGE], s.b[row] = problem.min_share, -1.0, 0.0
            row += 1
        if problem.max_force < 1e9:
            _set_row(problem.contacts, f, scale(-1.0, normal), pulls, row, s)
            s.b[row] = max(problem.max_force - pressing, MIN_ROOM * problem.max_force)
            row += 1
    for k in range(pulls, pulls + GRIP_COLUMNS + fingers):
        for j in range(pulls + GRIP_COLUMNS + fingers):
            s.A[row, j] = 0.0
        s.A[row, k], s.b[row] = -1.0, 0.0
        row += 1
    return row


@kernel
def _set_torque_rows(problem, shares, a, pulls, unit, row, s):
    """Both ways, the torque of driver ``a`` over what its limit leaves beside the loads."""
    contacts, limit = problem.contacts, problem.torque_limits[0, a]
    back = limit / problem.torque_limits[1, a]
    fingers, most = len(contacts), 0.0
    for load in range(len(shares)):
        torque = 0.0
        for f in range(fingers):
            for i in range(3):
                torque += problem.jacobians[f, i, a] * shares[load, f, i]
        most = max(most, abs(torque) / limit)
    for j in range(pulls + GRIP_COLUMNS + fingers):
        s.A[row, j] = 0.0
    for f in range(fingers):
        J = problem.jacobians[f]
        along = (J[0, a] / limit, J[1, a] / limit, J[2, a] / limit)
        if along != (0.0, 0.0, 0.0):
            _add_pulls(contacts, f, scale(unit, along), row, s)
    for j in range(pulls + GRIP_COLUMNS + fingers):
        s.A[row + 1, j] = -back * s.A[row, j]
    s.b[row] = max(1.0 - most, MIN_ROOM)
    s.b[row + 1] = max(1.0 - back * most, MIN_ROOM)


@kernel
def _set_row(contacts, f, direction, pulls, row, s):
    """A row with direction . f_finger by the pulls, and zeros."""
    for j in range(pulls + GRIP_COLUMNS + len(contacts)):
        s.A[row, j] = 0.0
    _add_pulls(contacts, f, direction, row, s)


@kernel
def _add_pulls(contacts, f, direction, row, s):
    """Add direction . f_finger by the pulls to a row."""
    pair = 0
    for a in range(len(contacts)):
        for b in range(a + 1, len(contacts)):
            if f in (a, b):
                towards = dot(direction, _pull_direction(contacts, a, b))
                s.A[row, pair] += towards if f == a else -towards
            pair += 1


@kernel
def _pull_direction(contacts, a, b):
    """Force on finger ``a`` by a unit pull between it and finger ``b``."""
    towards = subtract(get(contacts, b), get(contacts, a))
    return scale(1.0 / max(norm(towards), 1e-9), towards)
