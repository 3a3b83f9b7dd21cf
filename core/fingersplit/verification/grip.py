"""The grip force of a grasp: the least that carries the object under every load, within friction cones and torques.

Fingertips pull towards each other along the lines between them, so forces and moments sum to zero whatever their size.
A load is shared by the fingers as equally stiff fingertips share it: with least squared force.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

__all__ = ["Grip", "GripProblem", "least_grip"]

CONE_EDGES = 8
LEAST_NORMAL_FORCE = 2.0
"""Every finger presses with at least this [N], so that light objects stay in the hand."""
VIOLATION_COST = 100.0
"""What a newton outside a friction cone costs, in newtons of grip."""


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
        loads: Forces on the object's centre of mass that the fingers must balance, (L, 3) [N].
    """

    contacts: NDArray[np.float64]
    normals: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    torque_limits: NDArray[np.float64]
    center_of_mass: NDArray[np.float64]
    friction: float
    loads: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grip:
    """How hard the fingertips pull towards each other.

    Attributes:
        pulls: Force between the fingers of each pair, positive when they pull together, (P,) [N].
        forces: Resulting force of each finger on the object, (F, 3) [N].
        violation: Farthest that a contact force must leave its friction cone under some load [N]; zero when none must.
    """

    pulls: NDArray[np.float64]
    forces: NDArray[np.float64]
    violation: float


def least_grip(problem: GripProblem) -> Grip:
    """The grip of least largest normal force; where cones and torques leave no such grip, that of least violation."""
    fingers = len(problem.contacts)
    directions = _pull_directions(problem.contacts)  # (P, F, 3)
    shares = _load_shares(problem)  # (L, F, 3)
    edges = _cone_rows(problem.normals, problem.friction)  # (F, E, 3)
    pairs, loads = len(directions), len(problem.loads)
    # Unknowns: pulls (P), largest normal force, violation.
    cone = np.einsum("fek,pfk->fep", edges, directions).reshape(-1, pairs)
    cone_rows = np.column_stack([np.tile(-cone, (loads, 1)), np.zeros(loads * len(cone)), -np.ones(loads * len(cone))])
    cone_bounds = np.einsum("fek,lfk->lfe", edges, shares).ravel()
    normal = -np.einsum("fk,pfk->fp", problem.normals, directions)
    least_rows = np.column_stack([-normal, np.zeros(fingers), -np.ones(fingers)])
    most_rows = np.column_stack([normal, -np.ones(fingers), np.zeros(fingers)])
    torque = np.einsum("fkn,pfk->np", problem.jacobians, directions)
    load_torque = np.abs(np.einsum("fkn,lfk->ln", problem.jacobians, shares)).max(axis=0)
    room = np.maximum(problem.torque_limits - load_torque, 0.1 * problem.torque_limits)
    torque_rows = np.column_stack([np.vstack([torque, -torque]), np.zeros((2 * len(room), 2))])
    solution = linprog(
        c=np.concatenate([np.zeros(pairs), [1.0, VIOLATION_COST]]),
        A_ub=np.vstack([cone_rows, least_rows, most_rows, torque_rows]),
        b_ub=np.concatenate(
            [cone_bounds, np.full(fingers, -LEAST_NORMAL_FORCE), np.zeros(fingers), room, room]
        ),
        bounds=[(None, None)] * pairs + [(0, None)] * 2,
    )
    pulls = solution.x[:pairs]
    return Grip(pulls, np.einsum("p,pfk->fk", pulls, directions), float(solution.x[-1]))


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


def _cone_rows(normals: NDArray[np.float64], friction: float) -> NDArray[np.float64]:
    """Rows (F, E, 3): a force is inside the circumscribed cone of its finger when all products are at least zero."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    angles = 2 * np.pi * np.arange(CONE_EDGES) / CONE_EDGES
    tangents = np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None]
    return np.asarray(tangents - friction * normals[:, None])
