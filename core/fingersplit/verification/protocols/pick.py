"""The whole execution: approach, closing, lift and hold, with table and obstacles there and gravity on."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fingersplit.verification.protocol import Phase, Protocol, Trial, setting

__all__ = ["Pick"]


@dataclass(frozen=True)
class Pick(Protocol):
    """Pick an object that rests on its support; needs a scene with one, and a grasp with a free approach."""

    name: ClassVar[str] = "pick"

    gravity: float = setting(9.81, "m/s^2", "Gravity that the grip is planned for.", 0.0, 100.0)
    settle_time: float = setting(0.3, "s", "Time for the object to come to rest before the hand comes.", 0.0, 10.0)
    approach_time: float = setting(1.0, "s", "Time of the approach.", 0.1, 10.0)
    close_time: float = setting(0.8, "s", "Time in which the fingers close to the planned grasp.", 0.1, 10.0)
    lift_time: float = setting(1.0, "s", "Time of the retreat.", 0.1, 10.0)
    height: float = setting(0.1, "m", "Length of the retreat that the grip is planned for.", 0.0, 1.0)
    hold_time: float = setting(1.0, "s", "Time that the object is held at the end.", 0.1, 60.0)
    largest_push: float = setting(
        0.01, "m", "Most that the object may be pushed before the last finger touches.", 0.0, 1.0
    )
    support_friction: float = setting(0.6, "1", "Sliding friction between object and support.", 0.0, 5.0)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """One: lift along the retreat, hold."""
        phases = (Phase("lift", self.lift_time, self._rise), Phase("hold", self.hold_time))
        return (Trial("pick", phases, (0.0, 0.0, -self.gravity)),)

    def _rise(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        s = times / self.lift_time
        return np.outer(self.height * s**3 * (10 - 15 * s + 6 * s**2), (0, 0, 1))
