"""Whether a grasp holds: how much friction it has to spare while it carries the object, whichever way is down.

For gravity along each of the six directions of the object's axes, contact forces f are sought that balance the weight,
stay inside the friction cones and ask no joint for more than its torque limit. Of all such forces, the margin is the
largest s for which every contact could carry s newtons more along its surface before it slips:

    maximise s  subject to  G f = -w,  mu_i n_i . f_i - |f_i,t| >= s,  |J_i^T f_i| <= tau,  n_i . f_i <= f_max,

a linear program with the cones inscribed pyramids [Kerr1986, Boyd2007]. The grasp's margin is that of the worst
direction. The friction of a contact is what the surface about it leaves: where normals within a pad's footprint differ
from the contact's by the mean angle delta, mu_i = tan(atan(mu) - delta / 2), so contacts near edges count for less.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.contacts.linear_program import MAX_ROWS, MAX_VARIABLES, maximize
from fingersplit.hands.limits import MAX_FINGERS
from fingersplit.objects.grid import cell_range
from fingersplit.objects.surface import Surface
from fingersplit.threads import in_threads
from fingersplit.vectors_kernel import add, angle_between, cross, dot, get, norm, scale, subtract

__all__ = ["GRAVITY", "Contacts", "Holding", "assess_holding", "footprint_friction"]

GRAVITY = 9.81
"""[m/s^2]"""
MAX_FORCE = 30.0
"""Normal force of one contact [N], where joint torques leave it unbounded."""
FACETS = 8
"""Of the pyramid inscribed in a friction cone."""
FOOTPRINT = 4e-3
"""Radius about a contact within which the surface's normals count [m]."""
GRIP_SHARE = 0.6
"""Share of the friction that the reported forces use, so that they hold with something to spare."""

OTHER_SIDE = -0.5
"""Cosine to the contact's normal below which a sample lies on the far side of a thin part."""
MIN_SINGULAR = 1e-4
"""Least over largest singular value of the grasp matrix below which contacts count as lying on a line."""

JUDGED = 8
"""Fewest grasps that a thread judges at a time."""

SCRATCH = np.dtype(
    [
        ("w", np.float64, MAX_ROWS),
        ("z", np.float64, MAX_ROWS),
        ("dw", np.float64, MAX_ROWS),
        ("dz", np.float64, MAX_ROWS),
        ("primal", np.float64, MAX_ROWS),
        ("target", np.float64, MAX_ROWS),
        ("dual", np.float64, MAX_VARIABLES),
        ("matrix", np.float64, (MAX_VARIABLES, MAX_VARIABLES)),
        ("columns", np.float64, (MAX_VARIABLES, 2)),
        ("A", np.float64, (MAX_ROWS, MAX_VARIABLES)),
        ("b", np.float64, MAX_ROWS),
        ("c", np.float64, MAX_VARIABLES),
        ("x", np.float64, MAX_VARIABLES),
        ("frictions", np.float64, MAX_FINGERS),
    ],
    align=True,
)
"""Scratch memory of the linear programs, and friction by contact."""


@dataclass(frozen=True, eq=False)
class Holding:
    """How a grasp holds the object.

    Attributes:
        margin: Friction force that the weakest contact has to spare in the worst direction, at the best forces [N];
            negative when the weight cannot be carried, minus infinity when no forces balance it.
        gravity: The worst direction of gravity in the object frame, (3,).
        frictions: Friction coefficient that counts at each contact, (F,).
        forces: Smallest forces on the object that carry the weight in that direction, (F, 3) [N], None when none do.
    """

    margin: float
    gravity: NDArray[np.float64]
    frictions: NDArray[np.float64]
    forces: NDArray[np.float64] | None


class Contacts(NamedTuple):
    """Contacts of n grasps of one object by one hand, F fingers each.

    Attributes:
        points: Contact points, (n, F, 3) [m].
        normals: Outward surface normals there, (n, F, 3).
        jacobians: Of the pads by their finger's joints, (n, F, 3, MAX_CHAIN_JOINTS) [m/rad].
        torque_limits: Largest torque of each finger's joints, infinite where there is no joint,
            (F, MAX_CHAIN_JOINTS) [N m].
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    torque_limits: NDArray[np.float64]


def assess_holding(
    contacts: Contacts,
    surface: Surface,
    friction: float,
    mass: float,
    center: NDArray[np.float64],
    threads: int = 1,
) -> list[Holding]:
    """How each of n grasps holds an object.

    Args:
        contacts: The grasps.
        surface: The object's surface.
        friction: Coulomb friction coefficient between pads and object.
        mass: Of the object [kg].
        center: Its centre of mass, (3,) [m].
        threads: Grasps judged at a time.
    """
    n, fingers, _ = contacts.points.shape
    arms = contacts.points - center
    length = max(float(np.abs(arms).max()), 1e-6)
    G = np.zeros((n, 6, 3 * fingers))  # wrench, torques over a length
    for f in range(fingers):
        G[:, :3, 3 * f : 3 * f + 3] = np.eye(3)
        G[:, 3:, 3 * f : 3 * f + 3] = _cross_matrices(arms[:, f] / length)
    _, singular, V = np.linalg.svd(G)
    weights = np.zeros((6, 6))
    weights[:, :3] = -mass * GRAVITY * _DIRECTIONS
    particular = np.einsum("nij,dj->ndi", np.linalg.pinv(G), weights)  # (n, 6 directions, 3 F)
    spread = singular[:, -1] > MIN_SINGULAR * singular[:, 0]
    null = np.ascontiguousarray(V[:, 6:].transpose(0, 2, 1))
    frictions, margins = np.empty((n, fingers)), np.empty((n, 6))
    forces, found = np.empty((n, fingers, 3)), np.zeros(n, np.bool_)

    def judge(part: slice) -> None:
        points, normals, jacobians, limits = contacts
        grasps = Contacts(points[part], normals[part], jacobians[part], limits)
        given = particular[part], null[part], spread[part]
        results = frictions[part], margins[part], forces[part], found[part]
        _assess(grasps, surface, friction, *given, *results, np.zeros(1, SCRATCH))

    in_threads(judge, n, JUDGED, threads)
    worst = margins.argmin(axis=1)
    return [
        Holding(float(margins[i, worst[i]]), _DIRECTIONS[worst[i]], frictions[i], forces[i] if found[i] else None)
        for i in range(n)
    ]


_DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])


def _cross_matrices(arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices (n, 3, 3) of the cross products with ``arms`` (n, 3)."""
    x, y, z = arms.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)


@kernel
def _assess(contacts, surface, friction, particular, null, spread, frictions, margins, forces, found, scratches):
    """Frictions (n, F), margins (n, 6), and the worst direction's forces (n, F, 3) where any are ``found`` (n,)."""
    s = scratches[0]
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
        for d in range(6):
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
        first, second = _tangents(inward)
        bound = scale(-share * frictions[f] * math.cos(math.pi / FACETS), inward)
        for k in range(FACETS):
            angle = 2.0 * math.pi * k / FACETS
            facet = add(bound, add(scale(math.cos(angle), first), scale(math.sin(angle), second)))
            _set_row(particular, null, f, facet, 0.0, 1.0, row, s)
            row += 1
        _set_row(particular, null, f, scale(1.0 / MAX_FORCE, inward), 1.0, 0.0, row, s)
        row += 1
        for k in range(contacts.torque_limits.shape[1]):
            limit = contacts.torque_limits[f, k]
            if limit < math.inf:
                J = contacts.jacobians[i, f]
                torque = (J[0, k] / limit, J[1, k] / limit, J[2, k] / limit)
                _set_row(particular, null, f, torque, 1.0, 0.0, row, s)
                _set_row(particular, null, f, scale(-1.0, torque), 1.0, 0.0, row + 1, s)
                row += 2
    return row


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
def _tangents(normal):
    """Two unit vectors that span the plane across a unit vector."""
    first = cross(normal, (1.0, 0.0, 0.0) if abs(normal[0]) < 0.7 else (0.0, 1.0, 0.0))
    first = scale(1.0 / norm(first), first)
    return first, cross(normal, first)


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
