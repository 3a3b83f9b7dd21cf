"""DexGraspNet's test: gravity along each of the object's axes, both ways [DexGraspNet]."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fingersplit.verification.protocol import Phase, Protocol, Trial, setting

__all__ = ["GravitySix"]


@dataclass(frozen=True)
class GravitySix(Protocol):
    """An object of its own weight under gravity from six sides, from the same start."""

    name: ClassVar[str] = "gravity_six"

    gravity: float = setting(9.81, "m/s^2", "Gravity.", 0.0, 100.0)
    hold_time: float = setting(1.0, "s", "How long each gravity lasts.", 0.1, 60.0)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Six gravities."""
        return tuple(
            Trial(f"{sign}{axis}", (Phase("hold", self.hold_time),), tuple(factor * self.gravity * direction))
            for axis, direction in zip("xyz", np.eye(3), strict=True)
            for sign, factor in (("+", 1), ("-", -1))
        )
