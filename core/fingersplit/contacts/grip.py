"""The grip force of a grasp: the least that carries the object under every load, within friction cones and torques.

It is planned for the friction that the grasp was planned for. Whether the world has that friction, no hand knows.

Fingertips pull towards each other along the lines between them, so forces and moments sum to zero whatever their size.
A load is shared by the fingers as equally stiff fingertips share it: with least squared force.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from fingersplit.contacts.cones import facet_directions
from fingersplit.contacts.grasp_matrix import grasp_matrix
from fingersplit.contacts.linear_program import maximum

__all__ = ["Grip", "GripProblem", "least_grip"]

TANGENTIAL_COST, VIOLATION_COST, LACK_COST, SHORTAGE_COST = 1.0, 100.0, 1000.0, 20.0
"""What a newton along a surface, outside a friction cone, missing in pressing and missing in a finger's share of the
grip cost in newtons of grip."""
MIN_VIOLATION = 1e-3
"""Forces that leave their cones by less count as inside [N]."""
AT_LIMIT = 1e-6
"""Share of a torque limit that is left when a joint counts as spent."""


@dataclass(frozen=True, eq=False)
class GripProblem:
    """What the grip must do; all in one frame.

    Attributes:
        contacts: Where the fingers touch, (F, 3) [m].
        normals: Outward surface normals there, (F, 3).
        jacobians: Contact velocities by the joints, (F, 3, N) [m/rad].
        torque_limits: Largest joint torques, (N,) [N m].
        center_of_mass: Of the object, (3,) [m].
        friction: Sliding friction coefficient that may be relied on, one number or one a finger (F,).
        least_forces: Each finger presses with at least this, where its pulls can press at all, (F,) [N].
        loads: Forces on the object's centre of mass that the fingers must balance, (L, 3) [N].
        max_force: Largest normal force of a finger with its share of a load [N].
        min_share: Each finger presses with at least this share of the strongest one's force, where its pulls can.
    """

    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    torque_limits: NDArray[np.float64]
    center_of_mass: NDArray[np.float64]
    friction: float | NDArray[np.float64]
    least_forces: NDArray[np.float64]
    loads: NDArray[np.float64]
    max_force: float = np.inf
    min_share: float = 0.0


@dataclass(frozen=True, eq=False)
class Grip:
    """How hard the fingertips pull towards each other.

    Attributes:
        pulls: Force between the fingers of each pair, positive when they pull together, (P,) [N].
        forces: Resulting force of each finger on the object, (F, 3) [N].
        violation: Farthest that a contact force must leave its friction cone under some load [N]; zero when none must.
        limited: Whether it would be larger if the joints had more torque.
    """

    pulls: NDArray[np.float64]
    forces: NDArray[np.float64]
    violation: float
    limited: bool


def least_grip(problem: GripProblem) -> Grip:
    """The grip of least normal and tangential forces; where cones and torques leave none, that of least violation."""
    directions, shares = _pull_directions(problem.contacts), _load_shares(problem)  # (P, F, 3), (L, F, 3)
    tangents = facet_directions(problem.normals)  # (F, E, 3)
    pairs, fingers, edges = len(directions), len(problem.contacts), tangents.shape[1]
    limits, friction = problem.torque_limits, np.broadcast_to(problem.friction, fingers)
    # Unknowns: pulls (P), largest normal force, violation, lack of pressing, shortage of a share, tangential force of
    # each finger (F).
    normal = -np.einsum("fk,pfk->fp", problem.normals, directions)
    tangential = np.einsum("fek,pfk->fep", tangents, directions)
    outside = (tangential - friction[:, None, None] * normal[:, None]).reshape(-1, pairs)
    cones = tangents + friction[:, None, None] * problem.normals[:, None]
    outside_by_load = np.einsum("fek,lfk->lfe", cones, shares)
    pressing_by_load = -np.einsum("fk,lfk->lf", problem.normals, shares).min(axis=0)
    torque = np.einsum("fkn,pfk->np", problem.jacobians, directions) / limits[:, None]
    torque_of_load = np.abs(np.einsum("fkn,lfk->ln", problem.jacobians, shares)).max(axis=0) / limits
    room = np.maximum(1.0 - torque_of_load, 0.1)
    none, of_finger = np.zeros, np.repeat(np.eye(fingers), edges, axis=0)

    def rows(pull: NDArray[np.float64], *slacks: float, along: Any = 0.0) -> NDArray[np.float64]:
        """Rows for pulls, slacks (largest, violation, lack, shortage) and tangential forces."""
        padded = np.tile([*slacks, *(0.0 for _ in range(4 - len(slacks)))], (len(pull), 1))
        return np.column_stack([pull, padded, np.broadcast_to(along, (len(pull), fingers))])

    blocks = [
        (rows(outside, 0, -1), -outside_by_load.max(axis=0).ravel()),
        (rows(tangential.reshape(-1, pairs), along=-of_finger), none(len(outside))),
        (rows(normal, -1), none(fingers)),
        (rows(-normal, 0, 0, -1), -problem.least_forces),
        (np.eye(4 + fingers, pairs + 4 + fingers, pairs) * -1.0, none(4 + fingers)),
    ]
    if problem.min_share > 0.0:
        blocks.append((rows(-normal, problem.min_share, 0, 0, -1), none(fingers)))
    if np.isfinite(problem.max_force):
        blocks.append((rows(normal), np.maximum(problem.max_force - pressing_by_load, 0.1 * problem.max_force)))
    blocks.append((rows(np.vstack([torque, -torque])), np.concatenate([room, room])))
    A, b = np.vstack([block[0] for block in blocks]), np.concatenate([block[1] for block in blocks])
    slack_costs = [1.0, VIOLATION_COST, LACK_COST, SHORTAGE_COST]
    costs = np.concatenate([none(pairs), slack_costs, np.full(fingers, TANGENTIAL_COST)])
    unit = max(float(np.abs(b[: -2 * len(limits)]).max()), 1.0)  # of force [N], in which the program is of order one
    A[-2 * len(limits) :] *= unit
    b[: -2 * len(limits)] /= unit
    solution = maximum(-costs, A, b)
    if solution is None:  # interior points stall on some programs with many parallel rows
        solution = linprog(costs, A, b, bounds=(None, None), method="highs").x
    if solution is None:
        raise ArithmeticError("The linear program of a grip did not converge.")  # it has a solution by its form
    pulls, violation = unit * solution[:pairs], unit * max(float(solution[pairs + 1]), 0.0)
    at_limit = (b - A @ solution)[-2 * len(limits) :] <= AT_LIMIT
    limited = violation > MIN_VIOLATION and bool(at_limit.any())
    return Grip(pulls, np.einsum("p,pfk->fk", pulls, directions), violation, limited)


def _pull_directions(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Forces (P, F, 3) on the fingers by a unit pull between each pair."""
    pairs = list(combinations(range(len(points)), 2))
    directions = np.zeros((len(pairs), len(points), 3))
    for row, (a, b) in zip(directions, pairs, strict=True):
        towards = points[b] - points[a]
        row[a] = towards / max(float(np.linalg.norm(towards)), 1e-9)
        row[b] = -row[a]
    return directions


def _load_shares(problem: GripProblem) -> NDArray[np.float64]:
    """Forces (L, F, 3) of the fingers that balance each load with least sum of squares."""
    G = grasp_matrix(problem.contacts, problem.center_of_mass)
    wrenches = np.hstack([-problem.loads, np.zeros_like(problem.loads)])
    return np.asarray((wrenches @ np.linalg.pinv(G).T).reshape(len(wrenches), -1, 3))
