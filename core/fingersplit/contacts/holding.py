"""Whether a grasp holds: how much friction it has to spare while it carries the object, for each direction of gravity.

For gravity along each of the six directions of the object's axes, contact forces f are sought that balance the weight,
stay inside the friction cones and ask no joint for more than its torque limit. Of all such forces, the margin is the
largest s for which every contact could carry s newtons more along its surface before it slips:

    maximise s  subject to  G f = -w,  mu_i n_i . f_i - |f_i,t| >= s,  |J_i^T f_i| <= tau,  n_i . f_i <= f_max,

a linear program with the cones inscribed pyramids [Kerr1986, Boyd2007]. The grasp's margin is that of the worst
direction. The friction of a contact is what the surface about it leaves: where normals within a pad's footprint differ
from the contact's by the mean angle delta, mu_i = tan(atan(mu) - delta / 2), so contacts near edges count for less.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grasp_matrix import grasp_matrix
from fingersplit.contacts.holding_kernel import assess_grasps
from fingersplit.contacts.linear_program_kernel import LINEAR_PROGRAM
from fingersplit.objects.surface import Surface
from fingersplit.threads import in_threads

__all__ = ["GRAVITY", "Contacts", "Holding", "assess_holding"]

GRAVITY = 9.81
"""[m/s^2]"""
MIN_SINGULAR = 1e-4
"""Least over largest singular value of the grasp matrix below which contacts count as lying on a line."""

JUDGED = 8
"""Fewest grasps that a thread judges at a time."""


@dataclass(frozen=True, eq=False)
class Holding:
    """How a grasp holds the object.

    Attributes:
        margin: Friction force that the weakest contact has to spare in the worst direction, at the best forces [N];
            negative when the weight cannot be carried, minus infinity when no forces balance it.
        gravity: Direction of its force in the object frame, (3,): of gravity, where the weight is all there is.
        frictions: Friction coefficient that counts at each contact, (F,).
        forces: Smallest forces on the object that carry that load, (F, 3) [N], None when none do.
        load: Number of the worst load.
    """

    margin: float
    gravity: NDArray[np.float64]
    frictions: NDArray[np.float64]
    forces: NDArray[np.float64] | None
    load: int = 0


class Contacts(NamedTuple):
    """Contacts of n grasps of one object by one hand, F fingers each.

    Attributes:
        points: Contact points, (n, F, 3) [m].
        normals: Outward surface normals there, (n, F, 3).
        jacobians: Of the pads by the drivers, J S, (n, F, 3, A) [m/rad].
        torque_limits: Largest torque of each driver, infinite where nothing limits it, (A,), or those
            towards larger and towards smaller angles, (2, A) [N m].
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
    loads: NDArray[np.float64] | None = None,
) -> list[Holding]:
    """How each of n grasps holds an object.

    Args:
        contacts: The grasps.
        surface: The object's surface.
        friction: Coulomb friction coefficient between pads and object.
        mass: Of the object [kg].
        center: Its centre of mass, (3,) [m].
        threads: Grasps judged at a time.
        loads: Wrenches on the object about its centre of mass, object frame, force first, (L, 6) [N, N m]; None for its
            weight along the six directions of its axes.
    """
    if loads is None:
        loads = np.hstack([mass * GRAVITY * _DIRECTIONS, np.zeros((6, 3))])
    n, fingers, _ = contacts.points.shape
    length = max(float(np.abs(contacts.points - center).max()), 1e-6)
    G = grasp_matrix(contacts.points, center, length)  # (n, 6, 3 F)
    _, singular, V = np.linalg.svd(G)
    balancing = -loads / np.array([1.0, 1.0, 1.0, length, length, length])
    particular = np.einsum("nij,dj->ndi", np.linalg.pinv(G), balancing)  # (n, L, 3 F)
    spread = singular[:, -1] > MIN_SINGULAR * singular[:, 0]
    null = np.ascontiguousarray(V[:, 6:].transpose(0, 2, 1))
    frictions, margins = np.empty((n, fingers)), np.empty((n, len(loads)))
    forces, found = np.empty((n, fingers, 3)), np.zeros(n, np.bool_)

    limits = np.ascontiguousarray(np.broadcast_to(contacts.torque_limits, (2, contacts.jacobians.shape[3])))

    def judge(part: slice) -> None:
        points, normals, jacobians, _ = contacts
        grasps = Contacts(points[part], normals[part], jacobians[part], limits)
        given = particular[part], null[part], spread[part]
        results = frictions[part], margins[part], forces[part], found[part]
        assess_grasps(grasps, surface, friction, *given, *results, np.zeros(1, LINEAR_PROGRAM))

    in_threads(judge, n, JUDGED, threads)
    worst = margins.argmin(axis=1)
    directions = loads[:, :3] / np.maximum(np.linalg.norm(loads[:, :3], axis=1, keepdims=True), 1e-12)
    return [
        Holding(
            margin=float(margins[i, worst[i]]),
            gravity=directions[worst[i]],
            frictions=frictions[i],
            forces=forces[i] if found[i] else None,
            load=int(worst[i]),
        )
        for i in range(n)
    ]


_DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])
