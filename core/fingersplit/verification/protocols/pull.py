"""Pulling at a lifted object from six sides, as hard as half its weight."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fingersplit.verification.protocol import Phase, Trial, setting
from fingersplit.verification.protocols.lift import Lift

__all__ = ["Pull"]


@dataclass(frozen=True)
class Pull(Lift):
    """Lift an object of its own weight, then pull it with half that weight along +-x, +-y, +-z, each from the start."""

    name: ClassVar[str] = "pull"

    decided_after: float | None = setting(
        1.0, "s", "Time from which a pull whose verdict stands may end; the pull has begun by then.", 0.1, 60.0
    )
    height: float = setting(0.1, "m", "How far the palm is lifted, along z.", 0.0, 1.0)
    lift_time: float = setting(0.5, "s", "Time that the lift takes.", 0.1, 10.0)
    pull: float = setting(0.5, "1", "Pull for each newton of the object's weight.", 0.0, 10.0)
    pull_time: float = setting(1.0, "s", "How long the pull lasts.", 0.1, 60.0)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Six: gravity on, lift, pull."""
        first, lift, _ = super().trials[0].phases
        gravity = (0.0, 0.0, -self.gravity)
        return tuple(
            Trial(
                f"{sign}{axis}",
                (first, lift, Phase("pull", self.pull_time, pull=tuple(factor * self.pull * self.gravity * direction))),
                gravity,
            )
            for axis, direction in zip("xyz", np.eye(3), strict=True)
            for sign, factor in (("+", 1), ("-", -1))
        )
