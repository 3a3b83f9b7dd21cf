"""The grip that is published with a grasp: how hard each finger presses, and what to send to the hand for it.

It carries the object under gravity and acceleration from every side, whichever way the object is turned, and relies on
a share of the friction only. Hands that take positions get targets for servos of a stated stiffness, off the grasp by
torque over stiffness; hands that take torques get the torques at their drivers, S^T J^T f. Gravity of the fingers is
compensated in either.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip, GripProblem, least_grip
from fingersplit.contacts.holding import GRAVITY
from fingersplit.contacts.holding_kernel import MAX_FORCE
from fingersplit.grasp import Grasp
from fingersplit.hands.drivers import driver_jacobians, drivers_of, joints_of
from fingersplit.hands.hand import Hand

__all__ = ["GRIP_DEMAND", "GripDemand", "GripPlan", "plan_grip"]

_SIDES = np.vstack([np.eye(3), -np.eye(3)])


@dataclass(frozen=True)
class GripDemand:
    """What a published grip is planned for.

    Attributes:
        acceleration: Largest acceleration of the hand, in any direction beside gravity [m/s^2].
        min_acceleration: The same where torques leave no safe grip for more [m/s^2].
        load_margin: The grip carries this many times the load.
        friction_margin: Share of the planned friction that it relies on.
        min_force: Every finger presses with at least this [N].
        max_force: No finger presses with more, its share of the load included [N].
        min_share: Every finger presses with at least this share of the strongest one's force; one that cannot only
            supports.
        give: Deviation at which a driver's servo spends its torque limit [rad]: soft servos forgive an object that is
            not where it was planned.
        sag: Most that the load deviates a driver [rad]; the servo is stiffer where that takes it.
        damping_time: Damping over stiffness of a servo [s].
    """

    acceleration: float = 5.0
    min_acceleration: float = 1.0
    load_margin: float = 1.0
    friction_margin: float = 0.6
    min_force: float = 3.0
    max_force: float = MAX_FORCE
    min_share: float = 0.15
    give: float = 0.3
    sag: float = 0.012
    damping_time: float = 0.02

    def to_document(self) -> dict[str, Any]:
        """Every number as plain JSON data."""
        return asdict(self)


GRIP_DEMAND = GripDemand()
SUPPORTING = 0.1
"""A finger whose share of the grip is less than this of the strongest one's only supports."""


@dataclass(frozen=True, eq=False)
class GripPlan:
    """How hard to grip, and what to send to the hand for it.

    Attributes:
        forces: Force of each finger on the unloaded object, which balance each other, object frame (F, 3) [N].
        supporting: Whether each finger only supports, (F,).
        torques: Torques at the drivers for these forces, (A,) [N m].
        stiffness: Stiffness of the drivers' position servos, (A,) [N m/rad].
        damping: Their damping, (A,) [N m s/rad].
        targets: Joint angles that these servos are sent to, (N,) [rad].
        violation: Farthest that a contact force must leave its friction cone under some load [N].
        limited: Whether it would be safer if the drivers had more torque.
        load: Largest force on the object that it was planned to carry, from every side [N].
        friction: Friction coefficient that it relies on at each contact, (F,).
        max_force: Most that a finger presses with [N].
    """

    forces: NDArray[np.float64]
    supporting: NDArray[np.bool_]
    torques: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    targets: NDArray[np.float64]
    violation: float
    limited: bool
    load: float
    friction: NDArray[np.float64]
    max_force: float


def plan_grip(
    grasp: Grasp,
    hand: Hand,
    *,
    friction: float | NDArray[np.float64],
    mass: float,
    center_of_mass: NDArray[np.float64],
    demand: GripDemand = GRIP_DEMAND,
) -> GripPlan:
    """The grip of a grasp.

    Args:
        grasp: The grasp.
        hand: Its hand.
        friction: Planned friction coefficient, one number or one a contact (F,).
        mass: Of the object [kg].
        center_of_mass: Of the object, object frame (3,) [m].
        demand: What it must do.
    """
    contacts, normals = grasp.contacts, grasp.normals
    posed = hand.pose(grasp.joints, grasp.object_from_palm)
    jacobians = driver_jacobians(hand.arrays, posed.jacobians)
    relied = np.broadcast_to(demand.friction_margin * np.asarray(friction, np.float64), len(contacts))
    limits = hand.torque_ranges

    def least(acceleration: float) -> tuple[float, Grip]:
        load = demand.load_margin * mass * (GRAVITY + acceleration)
        problem = GripProblem(
            contacts=contacts,
            normals=normals,
            jacobians=jacobians,
            torque_limits=limits,
            center_of_mass=center_of_mass,
            friction=relied,
            least_forces=np.full(len(contacts), demand.min_force),
            loads=load * _SIDES,
            max_force=demand.max_force,
            min_share=demand.min_share,
        )
        return load, least_grip(problem)

    load, grip = least(demand.acceleration)
    if grip.limited:  # rather move slowly than press too little
        load, grip = least(demand.min_acceleration)
    pressing = -(normals * grip.forces).sum(axis=1)
    torques = np.einsum("fka,fk->a", jacobians, grip.forces)
    spent = np.where(torques < 0.0, limits[1], limits[0])
    stiffness = np.maximum(spent / demand.give, grip.load_torques / demand.sag)
    return GripPlan(
        forces=grip.forces,
        supporting=pressing < SUPPORTING * max(float(pressing.max()), 1e-9),
        torques=torques,
        stiffness=stiffness,
        damping=demand.damping_time * stiffness,
        targets=_targets(hand, grasp.joints, torques / stiffness),
        violation=grip.violation,
        limited=grip.limited,
        load=load,
        friction=relied,
        max_force=demand.max_force,
    )


def _targets(hand: Hand, joints: NDArray[np.float64], deviation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints (N,) with the drivers moved by ``deviation`` (A,) [rad] within their limits."""
    arrays = hand.arrays
    low, high = arrays.driver_lower[: len(deviation)], arrays.driver_upper[: len(deviation)]
    return joints_of(arrays, np.clip(drivers_of(arrays, joints) + deviation, low, high))
