"""The linear programs of ``holding``, grasp by grasp."""

import math

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.contacts.cone_kernel import FACETS, INSCRIBED, facet, tangents
from fingersplit.contacts.linear_program_kernel import maximize
from fingersplit.objects.grid_kernel import cell_range
from fingersplit.vectors_kernel import add, angle_between, dot, get, norm, scale, subtract

__all__ = ["FOOTPRINT", "GRIP_SHARE", "MAX_FORCE", "assess_grasps", "footprint_friction"]

MAX_FORCE = 30.0
"""Normal force of one contact [N], where joint torques leave it unbounded."""
FOOTPRINT = 4e-3
"""Radius about a contact within which the surface's normals count [m]."""
GRIP_SHARE = 0.6
"""Share of the friction that the reported forces use, so that they hold with something to spare."""

OTHER_SIDE = -0.5
"""Cosine to the contact's normal below which a sample lies on the far side of a thin part."""


@kernel
def assess_grasps(contacts, surface, friction, particular, null, spread, frictions, margins, forces, found, scratch):
    """Frictions (n, F), margins (n, L), and the worst load's forces (n, F, 3) where any are ``found`` (n,)."""
    s = scratch[0]
    free = null.shape[2]
    for i in range(len(frictions)):
        for f in range(frictions.shape[1]):
            frictions[i, f] = footprint_friction(
                surface, get(contacts.points[i], f), get(contacts.normals[i], f), friction
            )
        margins[i] = -np.inf
        if not spread[i]:
            continue
        worst = 0
        for d in range(margins.shape[1]):
            rows = _fill_rows(contacts, i, particular[i, d], null[i], frictions[i], 1.0, s)
            s.c[:], s.c[free] = 0.0, 1.0
            if maximize(s.c, s.A, s.b, rows, free + 1, s.x, s):
                margins[i, d] = s.x[free]
            if margins[i, d] < margins[i, worst]:
                worst = d
        if margins[i, worst] > 0.0:
            found[i] = _least_forces(contacts, i, particular[i, worst], null[i], frictions[i], s, forces[i])


@kernel
def _least_forces(contacts, i, particular, null, frictions, s, forces):
    """The forces with the least largest normal part, inside cones narrowed by ``GRIP_SHARE`` if there are any."""
    free = null.shape[1]
    for share in (GRIP_SHARE, 1.0):
        rows = _fill_rows(contacts, i, particular, null, frictions, share, s)
        for row in range(rows):
            s.A[row, free] = 0.0
        for f in range(len(forces)):
            inward = scale(-1.0, get(contacts.normals[i], f))
            s.b[rows] = -_component(particular, f, inward)
            for j in range(free):
                s.A[rows, j] = _component(null[:, j], f, inward)
            s.A[rows, free] = -1.0
            rows += 1
        s.c[:], s.c[free] = 0.0, -1.0
        if maximize(s.c, s.A, s.b, rows, free + 1, s.x, s):
            for f in range(len(forces)):
                for k in range(3):
                    forces[f, k] = particular[3 * f + k]
                    for j in range(free):
                        forces[f, k] += null[3 * f + k, j] * s.x[j]
            return True
    return False


@kernel
def _fill_rows(contacts, i, particular, null, frictions, share, s):
    """Inequalities A (y, s) <= b on the forces ``particular`` + ``null`` y of grasp ``i``; their number is returned."""
    row = 0
    for f in range(len(frictions)):
        inward = scale(-1.0, get(contacts.normals[i], f))
        first, second = tangents(inward)
        bound = scale(-share * frictions[f] * INSCRIBED, inward)
        for k in range(FACETS):
            _set_row(particular, null, f, add(bound, facet(first, second, k)), 0.0, 1.0, row, s)
            row += 1
        _set_row(particular, null, f, scale(1.0 / MAX_FORCE, inward), 1.0, 0.0, row, s)
        row += 1
    for a in range(contacts.torque_limits.shape[1]):
        _set_torque_rows(contacts, i, a, particular, null, row, s)
        row += 2
    return row


@kernel
def _set_torque_rows(contacts, i, a, particular, null, row, s):
    """Inequalities -1 <= sum_f J_f,a . f_f / limit <= 1 of driver ``a``: all the fingers that it moves count.

    The limits of both ways may differ.
    """
    free, limit = null.shape[1], contacts.torque_limits[0, a]
    back = 1.0 if limit == math.inf else limit / contacts.torque_limits[1, a]
    s.b[row], s.b[row + 1] = 1.0, 1.0
    s.A[row, : free + 1], s.A[row + 1, : free + 1] = 0.0, 0.0
    for f in range(contacts.jacobians.shape[1]):
        J = contacts.jacobians[i, f]
        torque = (J[0, a] / limit, J[1, a] / limit, J[2, a] / limit)
        if torque != (0.0, 0.0, 0.0):
            load = _component(particular, f, torque)
            s.b[row] -= load
            s.b[row + 1] += back * load
            for j in range(free):
                s.A[row, j] += _component(null[:, j], f, torque)
    for j in range(free):
        s.A[row + 1, j] = -back * s.A[row, j]


@kernel
def _set_row(particular, null, finger, direction, bound, slack, row, s):
    """Inequality direction . f_finger + slack s <= bound."""
    free = null.shape[1]
    s.b[row] = bound - _component(particular, finger, direction)
    for j in range(free):
        s.A[row, j] = _component(null[:, j], finger, direction)
    s.A[row, free] = slack


@kernel
def _component(forces, finger, direction):
    """Direction . f_finger of stacked forces (3 F,)."""
    return dot(direction, (forces[3 * finger], forces[3 * finger + 1], forces[3 * finger + 2]))


@kernel
def footprint_friction(surface, point, normal, friction):
    """Friction coefficient that counts at a contact: tan(atan(friction) - half the footprint's mean angle)."""
    grid, total, count = surface.grid, 0.0, 0
    low, high = cell_range(grid, point, FOOTPRINT)
    for x in range(low[0], high[0]):
        for y in range(low[1], high[1]):
            row = (x * grid.shape[1] + y) * grid.shape[2]
            for i in range(grid.starts[row + low[2]], grid.starts[row + high[2]]):
                there = get(surface.normals, i)
                if norm(subtract(get(grid.points, i), point)) < FOOTPRINT and dot(normal, there) > OTHER_SIDE:
                    total += angle_between(normal, there)
                    count += 1
    return math.tan(max(math.atan(friction) - 0.5 * total / max(count, 1), 0.0))
