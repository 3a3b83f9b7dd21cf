"""What a verification found: the verdict, why, and what happened frame by frame."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip

__all__ = ["BranchReport", "PhaseReport", "Reason", "Simulation", "Verification"]

Reason = Literal[
    "held",
    "slipped",
    "rotated",
    "contact_lost",
    "initial_penetration",
    "unstable_simulation",
    "joint_torque_saturated",
]

_EXPLANATIONS: dict[str, str] = {
    "held": "The object stayed in the hand in every phase.",
    "slipped": "The object moved farther in the hand than allowed.",
    "rotated": "The object turned farther in the hand than allowed.",
    "contact_lost": "At the end not every finger touched the object.",
    "initial_penetration": "The planned hand lies deeper inside the object's convex pieces than allowed.",
    "unstable_simulation": "The simulation diverged, so it shows nothing.",
    "joint_torque_saturated": "The object was lost because joints had no more torque to give.",
}


@dataclass(frozen=True, eq=False)
class Simulation:
    """What happened, about 100 frames a second; world frame, which is the object frame when the simulation starts.

    Branches follow each other: each begins where the squeeze ended, and its phases carry its name.

    Attributes:
        times: Time of each frame, (T,) [s].
        phases: Phase of each frame, an index into ``phase_names``, (T,) int64.
        phase_names: Such as ``"squeeze"``, ``"lift: hold"``.
        palm_positions: Palm origin, (T, 3) [m].
        palm_wxyz: Palm orientation, (T, 4).
        joints: Joint angles, (T, N) [rad].
        object_positions: Origin of the object frame, (T, 3) [m].
        object_wxyz: Orientation of the object, (T, 4).
        contact_positions: Where each finger presses, (T, F, 3) [m].
        contact_forces: Force of each finger on the object, zero without contact, (T, F, 3) [N].
    """

    times: NDArray[np.float64]
    phases: NDArray[np.int64]
    phase_names: tuple[str, ...]
    palm_positions: NDArray[np.float64]
    palm_wxyz: NDArray[np.float64]
    joints: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_wxyz: NDArray[np.float64]
    contact_positions: NDArray[np.float64]
    contact_forces: NDArray[np.float64]


@dataclass(frozen=True)
class PhaseReport:
    """One phase in numbers.

    Attributes:
        name: What was done.
        duration: How long [s].
        displacement: Farthest that the object's centre of mass was from its planned place in the hand [m].
        rotation: Most that it had turned in the hand [rad].
        lost_contacts: Fingers that did not touch when the phase ended.
        contact_force: Sum of all contact forces on the object, mean over the phase's last tenth of a second, (3,) [N].
        load: Force that they had to balance at its end, gravity and pull, (3,) [N].
        largest_force: Largest contact force of one finger [N].
        largest_penetration: Deepest that the hand was pressed into the object [m].
        saturated_joints: Joints that spent their torque limit in a tenth of the phase or more.
    """

    name: str
    duration: float
    displacement: float
    rotation: float
    lost_contacts: tuple[str, ...]
    contact_force: tuple[float, float, float]
    load: tuple[float, float, float]
    largest_force: float
    largest_penetration: float
    saturated_joints: tuple[str, ...]

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in self.__dict__.items()}


@dataclass(frozen=True)
class BranchReport:
    """One branch: the verdict on it, and its phases."""

    name: str
    reason: Reason
    phases: tuple[PhaseReport, ...]

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data."""
        return {
            "name": self.name,
            "passed": self.reason == "held",
            "reason": self.reason,
            "phases": [phase.to_document() for phase in self.phases],
        }


@dataclass(frozen=True, eq=False)
class Verification:
    """The evidence for or against one grasp.

    Attributes:
        protocol: Name of the preset.
        reason: Why it passed or not; of several failed branches, the first one's.
        simulator: Name and version.
        settings: Every number of protocol, controller and object.
        initial_penetration: Deepest that the planned hand lies inside the object's pieces [m].
        grip: How hard the fingers were to grip.
        squeeze: The squeeze before the branches; None when it did not come to that.
        branches: What was done afterwards.
        simulation: What happened; None when nothing was simulated.
        seconds: Time that it took [s].
    """

    protocol: str
    reason: Reason
    simulator: str
    settings: dict[str, Any]
    initial_penetration: float
    grip: Grip
    squeeze: PhaseReport | None
    branches: tuple[BranchReport, ...]
    simulation: Simulation | None
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether the grasp held in every branch."""
        return self.reason == "held"

    def to_document(self) -> dict[str, Any]:
        """The ``verification`` part of a result document, without the time series."""
        return {
            "protocol": self.protocol,
            "passed": self.passed,
            "reason": self.reason,
            "explanation": _EXPLANATIONS[self.reason],
            "simulator": self.simulator,
            "settings": self.settings,
            "initial_penetration": self.initial_penetration,
            "grip": {
                "forces": self.grip.forces.tolist(),
                "violation": self.grip.violation,
                "limited": self.grip.limited,
            },
            "squeeze": None if self.squeeze is None else self.squeeze.to_document(),
            "branches": [branch.to_document() for branch in self.branches],
            "time_ms": 1e3 * self.seconds,
        }
