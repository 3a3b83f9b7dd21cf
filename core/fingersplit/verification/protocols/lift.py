"""The paper's test [Fan2018]: squeeze, gravity on, lift, hold."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fingersplit.verification.protocol import Phase, Protocol, Trial, setting

__all__ = ["Lift"]


@dataclass(frozen=True)
class Lift(Protocol):
    """Lift an object of its own weight and hold it."""

    name: ClassVar[str] = "lift"

    time_step: float = setting(0.003, "s", "Simulation step after the squeeze.", 1e-4, 0.005)
    decided_after: float | None = setting(
        0.42,
        "s",
        "Time from which a lift whose verdict stands may end: the palm's acceleration is past its peak.",
        0.1,
        60.0,
    )
    gravity: float = setting(9.81, "m/s^2", "Gravity, along -z of the object.", 0.0, 100.0)
    gravity_time: float = setting(0.2, "s", "Time under gravity before the lift.", 0.0, 10.0)
    height: float = setting(0.2, "m", "How far the palm is lifted, along z.", 0.0, 1.0)
    lift_time: float = setting(1.0, "s", "Time that the lift takes.", 0.1, 10.0)
    hold_time: float = setting(1.0, "s", "Time that the object is held at the top.", 0.1, 60.0)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """One: gravity on, lift, hold."""
        phases = (
            Phase("gravity", self.gravity_time),
            Phase("lift", self.lift_time, self._rise),
            Phase("hold", self.hold_time),
        )
        return (Trial("lift", phases, (0.0, 0.0, -self.gravity)),)

    def _rise(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Up along the curve of least jerk, which starts and ends without velocity and acceleration."""
        s = times / self.lift_time
        return np.outer(self.height * s**3 * (10 - 15 * s + 6 * s**2), (0, 0, 1))
