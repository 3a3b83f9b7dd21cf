"""The contact forces that carry the object: a linear program over the friction cones."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from fingersplit.quality.metrics import WrenchSpace

__all__ = ["holding_forces"]

GRAVITY = 9.81
"""[m/s^2]"""


def holding_forces(space: WrenchSpace, mass: float) -> NDArray[np.float64] | None:
    """Forces on the object that carry its weight, whichever way is down.

    For gravity along each of the six directions of the object's axes, the forces inside the friction cones that balance
    the weight with the least largest normal force; those of the worst direction are returned.

    Args:
        space: Contacts, normals and friction.
        mass: Object mass [kg].

    Returns:
        Force of each finger on the object in the object frame, (F, 3) [N], or None when the cones cannot carry it.
    """
    worst, worst_forces = 0.0, None
    for direction in np.vstack([np.eye(3), -np.eye(3)]):
        solution = _least_forces(space, -mass * GRAVITY * direction)
        if solution is None:
            return None
        largest, forces = solution
        if largest >= worst:
            worst, worst_forces = largest, forces
    return worst_forces


def _least_forces(space: WrenchSpace, carried: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]] | None:
    """Cone forces whose resultant at the centre of mass is ``carried`` (3,) [N], and their largest normal part [N]."""
    edges = space.cone_forces()  # (F, E, 3), normal part 1 each
    fingers, edge_count, _ = edges.shape
    # Unknowns: the weight of every cone edge, then the bound on the normal forces.
    bound_rows = np.hstack([np.kron(np.eye(fingers), np.ones(edge_count)), -np.ones((fingers, 1))])
    solution = linprog(
        c=np.append(np.zeros(fingers * edge_count), 1.0),
        A_ub=bound_rows,
        b_ub=np.zeros(fingers),
        A_eq=np.hstack([space.cone_wrenches().T, np.zeros((6, 1))]),
        b_eq=np.concatenate([carried, np.zeros(3)]),
    )
    if solution.status != 0:
        return None
    weights = solution.x[:-1].reshape(fingers, edge_count)
    return float(solution.x[-1]), np.einsum("fe,fec->fc", weights, edges)
