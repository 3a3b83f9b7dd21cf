"""DexGraspBench's test: pull the object along each of its axes, both ways [DexGraspBench]."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fingersplit.verification.protocol import Phase, Protocol, Trial, setting

__all__ = ["SixDirection"]


@dataclass(frozen=True)
class SixDirection(Protocol):
    """A light object, pulled along +-x, +-y, +-z from the same start; no gravity besides."""

    name: ClassVar[str] = "six_direction"

    mass: float | None = setting(0.1, "kg", "Mass of the object.", 1e-3, 50.0)
    torsional_friction: float | None = setting(
        0.02, "m", "Torsional friction at a requested friction of 0.6, in proportion at others.", 0.0, 0.1
    )
    largest_displacement: float = setting(0.05, "m", "Most that the object may move in the hand.", 0.0, 1.0)
    all_contacts: bool = setting(False, "", "Whether every finger must touch at the end.", 0, 1)
    pull: float = setting(10.0, "N/kg", "Force on the object for each kg of it.", 0.0, 1e3)
    pull_time: float = setting(2.0, "s", "How long each pull lasts.", 0.1, 60.0)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Six pulls."""
        return tuple(
            Trial(f"{sign}{axis}", (Phase("pull", self.pull_time, pull=tuple(factor * self.pull * direction)),))
            for axis, direction in zip("xyz", np.eye(3), strict=True)
            for sign, factor in (("+", 1), ("-", -1))
        )
