"""The paper's test [Fan2018] to its end, without an early verdict."""

from dataclasses import dataclass
from typing import ClassVar

from fingersplit.verification.protocol import setting
from fingersplit.verification.protocols.lift import Lift

__all__ = ["LiftFull"]


@dataclass(frozen=True)
class LiftFull(Lift):
    """Lift an object of its own weight, hold it for a second, and judge at the end."""

    name: ClassVar[str] = "lift_full"

    time_step: float = setting(0.002, "s", "Simulation step after the squeeze.", 1e-4, 0.005)
    decided_after: float | None = setting(
        None, "s", "Time from which a trial whose verdict stands may end; none runs every phase to its end.", 0.1, 60.0
    )
