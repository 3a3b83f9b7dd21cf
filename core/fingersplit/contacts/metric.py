"""What a metric of a grasp is, and what it is computed from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.holding import Holding
from fingersplit.contacts.wrench_space import WrenchSpace

__all__ = ["GraspState", "Metric"]


@dataclass(frozen=True, eq=False)
class GraspState:
    """What metrics look at: a finished grasp, or one state on the way to it.

    Attributes:
        space: Contacts, friction cones and the wrenches that they can pass.
        scores: Q = w1 Q_o + w2 Q_h, w1 Q_o and w2 Q_h, (3,).
        holding: How the grasp holds the object; None for states on the way, for which nobody solved it.
    """

    space: WrenchSpace
    scores: NDArray[np.float64]
    holding: Holding | None = None


@dataclass(frozen=True)
class Metric:
    """A number that compares grasps, and all that documents, tables and recordings say about it.

    Attributes:
        name: Key in documents.
        title: Name for people, in tables and legends.
        unit: Unit as it stands in brackets, such as ``"N"``; empty for none.
        meaning: What it says, without the unit and without a full stop; after a semicolon the exceptions.
        higher_is_better: Whether a larger number is the better grasp.
        source: Key of REFERENCES.md, or where it is defined here.
        function: The number of a state; None where it has none.
        symbol: Curve in recordings and plots; the name when left out.
        may_be_missing: Whether some grasps have no number.
        in_tables: Whether tables for people have a column for it.
        recorded_states: States of a run at which recordings take it, evenly spread; None for all of them.
        order: Place among the others in documents and tables, small first.
    """

    name: str
    title: str
    unit: str
    meaning: str
    higher_is_better: bool
    source: str
    function: Callable[[GraspState], float | None]
    symbol: str = ""
    may_be_missing: bool = False
    in_tables: bool = True
    recorded_states: int | None = 16
    order: int = 100

    @property
    def heading(self) -> str:
        """Title and unit, as the heading of a column."""
        return f"{self.title} {self.unit}".strip()

    @property
    def curve(self) -> str:
        """What recordings and plots call it."""
        return self.symbol or self.name

    def to_document(self) -> dict[str, str | bool]:
        """What the API says of it, as plain JSON data."""
        return {
            "name": self.name,
            "title": self.title,
            "unit": self.unit,
            "meaning": f"{self.meaning}.",
            "higher_is_better": self.higher_is_better,
            "source": self.source,
            "in_tables": self.in_tables,
        }
