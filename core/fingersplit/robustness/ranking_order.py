"""By what ranked grasps are put in order, and how long that may take."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from fingersplit.errors import SettingsError
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.robustness.noise import NoiseModel

__all__ = ["RankBy", "RankingOrder"]

RankBy = Literal["p_hold", "holding_margin"]
"""What grasps are ranked by: the probability that they hold when executed, or the margin with which they do."""
MAX_BUDGET = 60.0
"""[s]"""


@dataclass(frozen=True)
class RankingOrder:
    """By what grasps are ranked.

    Attributes:
        by: What counts among grasps whose geometry is valid and that carry the weight.
        noise: What is not known exactly when they are executed.
        simulation_budget: Time for simulations of the best ones [s]; with 0 nothing is simulated.
        pieces: Gives the object as the simulation collides it; None for its own convex pieces.

    Raises:
        SettingsError: An unknown order, or a budget out of range.
    """

    by: str = "p_hold"
    noise: NoiseModel = field(default_factory=NoiseModel)
    simulation_budget: float = 0.0
    pieces: Callable[[], ConvexPieces] | None = None

    def __post_init__(self) -> None:
        if self.by not in get_args(RankBy):
            raise SettingsError(f"rank_by is {self.by!r}; known: {', '.join(get_args(RankBy))}.")
        if not 0.0 <= self.simulation_budget <= MAX_BUDGET:
            raise SettingsError(
                f"The simulation budget is {1e3 * self.simulation_budget:g} ms; allowed: 0 to {1e3 * MAX_BUDGET:g} ms."
            )
        if self.simulation_budget and self.by != "p_hold":
            raise SettingsError("A simulation budget needs rank_by p_hold; other orders simulate nothing.")

    def to_document(self) -> dict[str, Any]:
        """All numbers as plain JSON data, SI units."""
        return {"by": self.by, "noise": self.noise.to_document(), "simulation_budget": self.simulation_budget}
