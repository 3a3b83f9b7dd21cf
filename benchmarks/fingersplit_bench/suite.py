"""What a section of the benchmarks works with, and what it hands back."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from fingersplit.errors import FingersplitError
from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.preparing import prepare_object

__all__ = ["Bench", "BenchError", "Chapter", "Figure", "table"]


class BenchError(FingersplitError):
    """Benchmarks that cannot be run as asked for."""


@dataclass(frozen=True)
class Figure:
    """One measured number.

    Attributes:
        value: Median over ``runs`` measurements in ``unit``, or their mean if ``center`` says so.
        unit: Its unit.
        low: Lower quartile.
        high: Upper quartile.
        runs: Measurements that it is taken over.
        meaning: What was measured, in one sentence.
        beside: Numbers that belong to it, by name.
        center: ``"median"`` or ``"mean"``.
    """

    value: float
    unit: str
    low: float
    high: float
    runs: int
    meaning: str
    beside: dict[str, float] = field(default_factory=dict)
    center: str = "median"

    @classmethod
    def of(cls, samples: Sequence[float], unit: str, meaning: str, **beside: float) -> Self:
        """Median and quartiles of one or more measurements."""
        low, value, high = (float(x) for x in np.quantile(samples, (0.25, 0.5, 0.75)))
        return cls(value, unit, low, high, len(samples), meaning, beside)

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Chapter:
    """What a section adds to the report.

    Attributes:
        title: Heading.
        text: Markdown below it; pictures stand beside the report and are named by their file.
        figures: The numbers of ``report.FIGURES`` that it measured, by key.
        data: Everything behind the tables, plain JSON data.
    """

    title: str
    text: str
    figures: dict[str, Figure] = field(default_factory=dict)
    data: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Bench:
    """What every section measures with.

    Attributes:
        objects: Meshes by name, loaded when asked for.
        hand: The hand.
        folder: Where the report and its pictures go; exists.
        repeats: How often each measurement is taken.
        starts: Starts of an ordinary plan.
        note: Tells the user what is being measured.
        corpus: Folder of files for the section `intake`; None for our own objects.
        refit: Whether the section `holding` writes the coefficients of `p_hold` anew.
    """

    objects: Mapping[str, Callable[[], Mesh]]
    hand: Hand
    folder: Path
    repeats: int
    starts: int
    note: Callable[[str], None]
    corpus: Path | None = None
    refit: bool = False
    _models: dict[str, ObjectModel] = field(default_factory=dict)

    def model(self, name: str) -> ObjectModel:
        """The prepared object of that name, prepared once for all sections."""
        if name not in self._models:
            self.note(f"preparing {name}")
            self._models[name] = prepare_object(self.objects[name](), name)
        return self._models[name]


def table(headings: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Markdown table whose first ``left`` columns are aligned left and the others right."""
    lines = [headings, [*[":--"] * left, *["--:"] * (len(headings) - left)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
