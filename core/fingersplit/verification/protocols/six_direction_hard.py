"""Dexonomy's hard variant of the six pulls: half the sliding friction, a tenth of the torsional [Dexonomy]."""

from dataclasses import dataclass
from typing import ClassVar

from fingersplit.verification.protocol import setting
from fingersplit.verification.protocols.six_direction import SixDirection

__all__ = ["SixDirectionHard"]


@dataclass(frozen=True)
class SixDirectionHard(SixDirection):
    """Six pulls with slippery fingers."""

    name: ClassVar[str] = "six_direction_hard"

    friction_scale: float = setting(
        0.5, "1", "Scales the simulated friction only; grip forces use the planned friction.", 0, 10
    )
    torsional_friction: float | None = setting(
        0.002, "m", "Torsional friction at a requested friction of 0.6, in proportion at others.", 0.0, 0.1
    )
