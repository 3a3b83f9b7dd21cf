"""What a verification found, as it stands in results: verdicts, reasons and numbers, without the time series."""

from dataclasses import dataclass
from math import degrees, radians
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip
from fingersplit.contacts.grip_plan import GripPlan
from fingersplit.result.wire import Json, Vector3, described

__all__ = [
    "GripReport",
    "PhaseReport",
    "Reason",
    "TrialReport",
    "Verification",
    "VerificationSummary",
    "explanation",
    "is_firm",
    "slip_and_turn",
]

Reason = Literal[
    "held",
    "slipped",
    "rotated",
    "contact_lost",
    "initial_penetration",
    "unstable_simulation",
    "joint_torque_saturated",
    "not_at_rest",
    "obstacle_touched",
    "object_pushed",
]
"""Why a grasp passed or failed; only ``held`` is a pass."""

FIRM_SLIP, FIRM_TURN = 5e-3, radians(5.0)
"""An object that moves less in the hand is held firmly [m], [rad]."""

_EXPLANATIONS: dict[str, str] = {
    "held": "The object stayed in the hand in every phase.",
    "slipped": "The object moved farther in the hand than allowed.",
    "rotated": "The object turned farther in the hand than allowed.",
    "contact_lost": "At the end not every finger touched the object.",
    "initial_penetration": "The planned hand lies deeper inside the object's convex pieces than allowed.",
    "unstable_simulation": "The simulation diverged; it gives no evidence.",
    "joint_torque_saturated": "The object was lost because joints reached their torque limits.",
    "not_at_rest": "The object did not rest on its support as the scene says.",
    "obstacle_touched": "The hand touched an obstacle or support that it may not touch.",
    "object_pushed": "The object was pushed farther than allowed before the last finger touched it.",
}


def slip_and_turn(trials: tuple["TrialReport", ...]) -> tuple[float | None, float | None]:
    """Farthest that the object moved [m] and most that it turned [rad] in the hand, in any trial; None without one."""
    phases = [phase for trial in trials for phase in trial.phases]
    if not phases:
        return None, None
    return max(phase.displacement for phase in phases), max(phase.rotation for phase in phases)


def is_firm(slip: float | None, turn: float | None) -> bool:
    """Whether an object that was held moved so little that it stays where it was grasped."""
    return slip is not None and turn is not None and slip < FIRM_SLIP and turn < FIRM_TURN


def explanation(reason: Reason) -> str:
    """A reason in a sentence."""
    return _EXPLANATIONS[reason]


@dataclass(frozen=True)
class PhaseReport:
    """One phase of a simulation in numbers."""

    name: str = described("What was done")
    duration: float = described("How long", "s")
    displacement: float = described(
        "Farthest that the object's centre of mass was from its place in the hand before the hand closed, or, after "
        "that, when it had closed",
        "m",
    )
    rotation: float = described("Most that the object had turned in the hand since then", "rad")
    lost_contacts: tuple[str, ...] = described("Fingers that did not touch when the phase ended")
    contact_force: Vector3 = described("Sum of the contact forces on the object over the last 0.1 s, world frame", "N")
    load: Vector3 = described("Gravity and pull at the phase's end, world frame", "N")
    largest_force: float = described("Largest contact force of one finger", "N")
    largest_penetration: float = described("Deepest that the hand was pressed into the object", "m")
    saturated_joints: tuple[str, ...] = described("Joints that spent a tenth of the phase at their torque limit")


@dataclass(frozen=True)
class TrialReport:
    """What was done after the squeeze, and the verdict on it."""

    name: str = described("What distinguishes this trial, such as the direction of a pull")
    passed: bool = described("Whether the object was held")
    reason: Reason = described("Why it was or was not")
    phases: tuple[PhaseReport, ...] = described("The phases; empty when the simulation diverged")


@dataclass(frozen=True)
class GripReport:
    """The grip that the simulation pressed with: the published one, or the virtual frame's for the protocol's loads.

    It balances itself; the forces in `contacts` of the grasp carry the object's weight.
    """

    forces: tuple[Vector3, ...] = described("Force of each finger on the unloaded object, object frame", "N")
    violation: float = described("Farthest that a planned contact force leaves its friction cone", "N")
    limited: bool = described("Whether the joints have too little torque for a safer grip", default=False)

    def normal_forces(self, normals: NDArray[np.float64]) -> NDArray[np.float64]:
        """How hard each finger presses along the outward normals (F, 3), (F,) [N]."""
        return np.asarray(-(normals * np.array(self.forces)).sum(axis=1))

    @classmethod
    def of(cls, grip: Grip | GripPlan) -> Self:
        """The report of a grip."""
        return cls(tuple((x, y, z) for x, y, z in grip.forces.tolist()), grip.violation, grip.limited)


@dataclass(frozen=True)
class Verification:
    """Report of a grasp's simulation."""

    protocol: str = described("Name of the protocol")
    passed: bool = described("Whether the grasp held in every trial")
    held_firmly: bool = described(
        f"Whether it held with a slip below {1e3 * FIRM_SLIP:g} mm and a turn below {degrees(FIRM_TURN):g} degrees, "
        "both while the hand closed and after"
    )
    slip: float | None = described(
        "Farthest that the object moved in the closed hand in any trial; null when no trial was simulated", "m"
    )
    turn: float | None = described(
        "Most that the object turned in the closed hand in any trial; null when no trial was simulated", "rad"
    )
    reason: Reason = described("Why it passed or not; of several failed trials, the first one's reason")
    explanation: str = described("The reason in a sentence")
    simulator: str = described("Name and version of the simulator")
    settings: dict[str, Json] = described(
        "Every number of protocol, controller, object and solver, SI units and radians"
    )
    initial_penetration: float = described("Deepest that the planned hand lies inside the object", "m")
    grip: GripReport = described("How hard the fingers were to grip")
    squeeze: PhaseReport | None = described("The squeeze; null when the simulation did not get there")
    trials: tuple[TrialReport, ...] = described("What was done after the squeeze")
    time_ms: float = described("Time that the verification took", "ms")
    closing: PhaseReport | None = described(
        "The closing from the pre-grasp to the planned grasp; null for a hand that started there", default=None
    )
    touching: tuple[str, ...] | None = described(
        "Fingers that touched the object when the hand had closed; protocols that need no contact pass without. Null "
        "when nothing was simulated, and for picks",
        default=None,
    )


@dataclass(frozen=True)
class VerificationSummary:
    """How the verification of ranked grasps went."""

    protocol: str = described("Name of the protocol")
    controller: str = described("Name of the controller")
    wanted: int = described("How many grasps were to hold")
    tried: int = described("How many were verified, from rank 1 on")
    held: int = described("How many of these held")
    message: str = described("The outcome in a sentence")
    time_ms: float = described("Time that it took", "ms")
