"""Shaking: sinusoidal palm acceleration along each axis, slow and fast, with the object's own weight."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fingersplit.verification.protocol import Motion, Phase, Protocol, Trial, setting

__all__ = ["Shake"]


@dataclass(frozen=True)
class Shake(Protocol):
    """An object of its own weight, shaken along x, y and z from the same start."""

    name: ClassVar[str] = "shake"

    gravity: float = setting(9.81, "m/s^2", "Gravity, along -z of the object.", 0.0, 100.0)
    gravity_time: float = setting(0.2, "s", "Time under gravity before the shaking.", 0.0, 10.0)
    acceleration: float = setting(5.0, "m/s^2", "Peak acceleration of the palm.", 0.0, 100.0)
    slowest: float = setting(1.0, "Hz", "Frequency of the first, slow shaking.", 0.1, 50.0)
    fastest: float = setting(5.0, "Hz", "Frequency of the last, fast shaking.", 0.1, 50.0)
    shake_time: float = setting(1.0, "s", "Time at each frequency, rounded to whole periods.", 0.1, 60.0)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """One for each axis, at the slowest, the middle and the fastest frequency."""
        trials = []
        for axis, direction in zip("xyz", np.eye(3), strict=True):
            phases = [Phase("gravity", self.gravity_time)]
            for frequency in np.linspace(self.slowest, self.fastest, 3):
                time = max(1, round(self.shake_time * frequency)) / frequency
                phases.append(Phase(f"{frequency:g} Hz", time, self._swing(frequency, direction)))
            trials.append(Trial(axis, tuple(phases), (0.0, 0.0, -self.gravity)))
        return tuple(trials)

    def _swing(self, frequency: float, direction: NDArray[np.float64]) -> Motion:
        """To one side and back, so that the palm is at rest before and after."""
        rate = 2 * np.pi * frequency
        return lambda times: np.outer(self.acceleration / rate**2 * (1 - np.cos(rate * times)), direction)
