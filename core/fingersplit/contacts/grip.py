"""The grip force of a grasp: the least that carries the object under every load, within friction cones and torques.

It is planned for the friction that the grasp was planned for. Whether the world has that friction, no hand knows.

Fingertips pull towards each other along the lines between them, so forces and moments sum to zero whatever their size.
A load is shared by the fingers as equally stiff fingertips share it: with least squared force.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from fingersplit.contacts.grasp_matrix import grasp_matrix
from fingersplit.contacts.grip_kernel import GRIP_COLUMNS, VIOLATION, pull_fingers, solve_grip
from fingersplit.contacts.linear_program_kernel import LINEAR_PROGRAM

__all__ = ["Grip", "GripProblem", "least_grip"]

MIN_VIOLATION = 1e-3
"""Forces that leave their cones by less count as inside [N]."""
MIN_PIVOT = 1e-9
"""Contacts whose grasp matrix has a smaller pivot, of its largest, are treated as on a line."""
AT_LIMIT = 1e-6
"""Share of a torque limit that is left when a joint counts as spent."""


class GripProblem(NamedTuple):
    """What the grip must do; all in one frame.

    Attributes:
        contacts: Where the fingers touch, (F, 3) [m].
        normals: Outward surface normals there, (F, 3).
        jacobians: Contact velocities by the joints, (F, 3, N) [m/rad].
        torque_limits: Largest joint torques, (N,), or those towards larger and towards smaller angles, (2, N) [N m].
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
        load_torques: Largest torque that a load's share asks of each joint, beside the grip's own, (N,) [N m].
    """

    pulls: NDArray[np.float64]
    forces: NDArray[np.float64]
    violation: float
    limited: bool
    load_torques: NDArray[np.float64]


def least_grip(problem: GripProblem) -> Grip:
    """The grip of least normal and tangential forces; where cones and torques leave none, that of least violation."""
    fingers = len(problem.contacts)
    friction = np.ascontiguousarray(np.broadcast_to(np.asarray(problem.friction, np.float64), fingers))
    limits = np.ascontiguousarray(np.broadcast_to(problem.torque_limits, (2, problem.jacobians.shape[2])))
    arrays = problem._replace(
        friction=friction,
        torque_limits=limits,
        max_force=float(problem.max_force),
        min_share=float(problem.min_share),
    )
    program = np.rec.array(np.zeros(1, LINEAR_PROGRAM))[0]
    shares = _load_shares(problem)
    done, rows, torque_rows, unit = solve_grip(arrays, shares, program)
    pairs = fingers * (fingers - 1) // 2
    columns = pairs + GRIP_COLUMNS + fingers
    A, b, solution = program["A"][:rows, :columns], program["b"][:rows], program["x"][:columns]
    if not done:  # interior points stall on some programs with many parallel rows
        solution = linprog(-program["c"][:columns], A, b, bounds=(None, None), method="highs").x
    if solution is None:
        raise ArithmeticError("The linear program of a grip did not converge.")  # it has a solution by its form
    pulls, violation = unit * solution[:pairs], unit * max(float(solution[pairs + VIOLATION]), 0.0)
    at_limit = (b - A @ solution)[rows - torque_rows :] <= AT_LIMIT
    forces = np.empty((fingers, 3))
    pull_fingers(problem.contacts, pulls, forces)
    limited = violation > MIN_VIOLATION and bool(at_limit.any())
    load_torques = np.abs(np.einsum("fkn,lfk->ln", problem.jacobians, shares)).max(axis=0)
    return Grip(pulls, forces, violation, limited, load_torques)


def _load_shares(problem: GripProblem) -> NDArray[np.float64]:
    """Forces (L, F, 3) of the fingers that balance each load with least sum of squares."""
    G = grasp_matrix(problem.contacts, problem.center_of_mass)
    wrenches = np.hstack([-problem.loads, np.zeros_like(problem.loads)])
    Q, R = np.linalg.qr(G.T)  # a tenth of the time of an SVD
    pivots = np.abs(np.diag(R))
    inverse = np.linalg.solve(R, Q.T) if pivots.min() > MIN_PIVOT * pivots.max() else np.linalg.pinv(G).T
    return np.asarray((wrenches @ inverse).reshape(len(wrenches), -1, 3))
