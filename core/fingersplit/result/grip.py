"""The grip of a grasp as it stands in results."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip_plan import GripPlan
from fingersplit.errors import ResultError
from fingersplit.hands.hand import Hand
from fingersplit.result.wire import Vector3, described

__all__ = ["PlannedGrip"]


@dataclass(frozen=True)
class PlannedGrip:
    """How hard to grip, and what to send to the hand for it; gravity of the fingers is compensated beside it."""

    forces: tuple[Vector3, ...] = described(
        "Force of each finger on the unloaded object, in the order of the contacts, which balance each other, object "
        "frame",
        "N",
    )
    supporting: tuple[str, ...] = described(
        "Fingers that cannot take their share of the grip (a tenth of the strongest one's force) and only support"
    )
    torques: dict[str, float] = described(
        "For hands that take torques: torque of each driver for these forces, to be added to stiffness about the "
        "angles at which the fingers came to rest",
        "N m",
    )
    stiffness: dict[str, float] = described(
        "For hands that take positions: stiffness kp of each driver's servo, for which squeeze_joints press with these "
        "forces",
        "N m/rad",
    )
    damping: dict[str, float] = described("Damping kd of these servos", "N m s/rad")
    load: float = described("Largest force on the object that it is planned to carry, from every side", "N")
    friction: tuple[float, ...] = described("Friction coefficient that it relies on at each contact")
    max_force: float = described("Most that a finger may press with, its share of the load included", "N")
    violation: float = described("Farthest that a contact force must leave its friction cone under that load", "N")
    limited: bool = described("Whether the drivers have too little torque for a safer grip")

    @classmethod
    def from_plan(cls, plan: GripPlan, hand: Hand) -> Self:
        """The grip of arrays."""
        names = hand.driver_names

        def named(values: NDArray[np.float64]) -> dict[str, float]:
            return dict(zip(names, values.tolist(), strict=True))

        return cls(
            forces=tuple((x, y, z) for x, y, z in plan.forces.tolist()),
            supporting=tuple(f.name for f, only in zip(hand.fingers, plan.supporting.tolist(), strict=True) if only),
            torques=named(plan.torques),
            stiffness=named(plan.stiffness),
            damping=named(plan.damping),
            load=plan.load,
            friction=tuple(plan.friction.tolist()),
            max_force=plan.max_force,
            violation=plan.violation,
            limited=plan.limited,
        )

    def to_plan(self, hand: Hand, targets: NDArray[np.float64]) -> GripPlan:
        """The grip as arrays, with the joints (N,) [rad] that its servos are sent to.

        Raises:
            ResultError: Its drivers or fingers are not those of the hand.
        """

        def ordered(values: dict[str, float]) -> NDArray[np.float64]:
            if values.keys() != set(hand.driver_names):
                raise ResultError(f"The grip has drivers {sorted(values)}; {hand.name} has {list(hand.driver_names)}.")
            return np.array([values[name] for name in hand.driver_names])

        if len(self.forces) != len(hand.fingers):
            raise ResultError(f"The grip has {len(self.forces)} forces; {hand.name} has {len(hand.fingers)} fingers.")
        return GripPlan(
            forces=np.array(self.forces),
            supporting=np.array([finger.name in self.supporting for finger in hand.fingers]),
            torques=ordered(self.torques),
            stiffness=ordered(self.stiffness),
            damping=ordered(self.damping),
            targets=targets,
            violation=self.violation,
            limited=self.limited,
            load=self.load,
            friction=np.array(self.friction),
            max_force=self.max_force,
        )
