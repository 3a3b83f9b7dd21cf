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

__all__ = ["Grip", "GripProblem", "least_grip"]

CONE_EDGES = 8
TANGENTIAL_COST, VIOLATION_COST, LACK_COST = 1.0, 100.0, 1000.0
"""What a newton along a surface, outside a friction cone and missing in pressing cost in newtons of grip."""
MIN_VIOLATION = 1e-3
"""Forces that leave their cones by less count as inside [N]."""


@dataclass(frozen=True, eq=False)
class GripProblem:
    """What the grip must do; all in one frame.

    Attributes:
        contacts: Where the fingers touch, (F, 3) [m].
        normals: Outward surface normals there, (F, 3).
        jacobians: Contact velocities by the joints, (F, 3, N) [m/rad].
        torque_limits: Largest joint torques, (N,) [N m].
        center_of_mass: Of the object, (3,) [m].
        friction: Sliding friction coefficient that may be relied on.
        least_forces: Each finger presses with at least this, where its pulls can press at all, (F,) [N].
        loads: Forces on the object's centre of mass that the fingers must balance, (L, 3) [N].
    """

    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    torque_limits: NDArray[np.float64]
    center_of_mass: NDArray[np.float64]
    friction: float
    least_forces: NDArray[np.float64]
    loads: NDArray[np.float64]


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
    tangents = _tangents(problem.normals)  # (F, E, 3)
    pairs, fingers, edges = len(directions), len(problem.contacts), tangents.shape[1]
    limits = problem.torque_limits
    # Unknowns: pulls (P), largest normal force, violation, lack of pressing, tangential force of each finger (F).
    normal = -np.einsum("fk,pfk->fp", problem.normals, directions)
    tangential = np.einsum("fek,pfk->fep", tangents, directions)
    outside = (tangential - problem.friction * normal[:, None]).reshape(-1, pairs)
    outside_by_load = np.einsum("fek,lfk->lfe", tangents + problem.friction * problem.normals[:, None], shares)
    torque = np.einsum("fkn,pfk->np", problem.jacobians, directions)
    torque_of_load = np.abs(np.einsum("fkn,lfk->ln", problem.jacobians, shares)).max(axis=0)
    room = np.maximum(limits - torque_of_load, 0.1 * limits)
    none, of_finger = np.zeros, np.repeat(np.eye(fingers), edges, axis=0)

    def rows(
        pull: NDArray[np.float64], largest: float = 0.0, violation: float = 0.0, lack: float = 0.0, along: Any = 0.0
    ) -> NDArray[np.float64]:
        slacks = np.tile([largest, violation, lack], (len(pull), 1))
        return np.column_stack([pull, slacks, np.broadcast_to(along, (len(pull), fingers))])

    worst_load = outside_by_load.max(axis=0).ravel()
    solution = linprog(
        c=np.concatenate([none(pairs), [1.0, VIOLATION_COST, LACK_COST], np.full(fingers, TANGENTIAL_COST)]),
        A_ub=np.vstack(
            [
                rows(outside, violation=-1),
                rows(tangential.reshape(-1, pairs), along=-of_finger),
                rows(normal, largest=-1),
                rows(-normal, lack=-1),
                rows(np.vstack([torque, -torque])),
            ]
        ),
        b_ub=np.concatenate([-worst_load, none(len(outside)), none(fingers), -problem.least_forces, room, room]),
        bounds=[(None, None)] * pairs + [(0, None)] * (3 + fingers),
    )
    pulls, violation = solution.x[:pairs], float(solution.x[pairs + 1])
    at_limit = solution.slack[-2 * len(limits) :] <= 1e-6 * np.tile(limits, 2)
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
    arms = problem.contacts - problem.center_of_mass
    torques = [np.cross(arm, np.eye(3)).T for arm in arms]
    grasp_matrix = np.vstack([np.tile(np.eye(3), len(arms)), np.hstack(torques)])
    wrenches = np.hstack([-problem.loads, np.zeros_like(problem.loads)])
    return np.asarray((wrenches @ np.linalg.pinv(grasp_matrix).T).reshape(len(wrenches), len(arms), 3))


def _tangents(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (F, E, 3) all around each normal."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    angles = 2 * np.pi * np.arange(CONE_EDGES) / CONE_EDGES
    return np.asarray(np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None])
