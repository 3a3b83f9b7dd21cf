"""What an entry of a scene document may be: each kind reads a value, writes it and describes it as JSON Schema."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import SceneError

__all__ = ["Choice", "Flag", "Indices", "Kind", "Number", "Points", "Several", "Text", "Vector", "shown"]


class Kind(ABC):
    """What one entry may be."""

    @abstractmethod
    def read(self, value: Any) -> Any:
        """The checked value.

        Raises:
            SceneError: It is not what this kind accepts.
        """

    def write(self, value: Any) -> Any:
        """The value as plain JSON data."""
        return value

    @abstractmethod
    def schema(self) -> dict[str, Any]:
        """JSON Schema of the values."""


@dataclass(frozen=True)
class Number(Kind):
    """A finite number in a range."""

    unit: str
    low: float
    high: float

    def read(self, value: Any) -> float:
        """The number as a float."""
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            raise SceneError("", f"must be a number [{self.unit}], got {shown(value)}.")
        if not self.low <= value <= self.high:
            raise SceneError("", f"is {value!r}; allowed: {self.low:g} to {self.high:g} {self.unit}.")
        return float(value)

    def schema(self) -> dict[str, Any]:
        """A number with its range."""
        return {"type": "number", "minimum": self.low, "maximum": self.high}


@dataclass(frozen=True)
class Text(Kind):
    """A name."""

    longest: int = 200

    def read(self, value: Any) -> str:
        """The text itself."""
        if not isinstance(value, str) or not 1 <= len(value) <= self.longest:
            raise SceneError("", f"must be a text of 1 to {self.longest} characters, got {shown(value)}.")
        return value

    def schema(self) -> dict[str, Any]:
        """A text."""
        return {"type": "string", "minLength": 1, "maxLength": self.longest}


@dataclass(frozen=True)
class Choice(Kind):
    """One of several words."""

    words: tuple[str, ...]

    def read(self, value: Any) -> str:
        """The word itself."""
        if value not in self.words:
            raise SceneError("", f"is {shown(value)}; known: {', '.join(self.words)}.")
        return str(value)

    def schema(self) -> dict[str, Any]:
        """The words."""
        return {"enum": list(self.words)}


@dataclass(frozen=True)
class Flag(Kind):
    """True or false."""

    def read(self, value: Any) -> bool:
        """The flag itself."""
        if not isinstance(value, bool):
            raise SceneError("", f"must be true or false, got {shown(value)}.")
        return value

    def schema(self) -> dict[str, Any]:
        """A boolean."""
        return {"type": "boolean"}


@dataclass(frozen=True)
class Vector(Kind):
    """``sizes`` finite numbers, as a tuple; with ``normalised`` scaled to length one."""

    sizes: tuple[int, ...] = (3,)
    unit: str = "m"
    low: float = -1e3
    high: float = 1e3
    normalised: bool = False

    def read(self, value: Any) -> tuple[float, ...]:
        """The numbers as a tuple."""
        wanted = f"{' or '.join(map(str, self.sizes))} numbers [{self.unit}]"
        if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str) or len(value) not in self.sizes:
            raise SceneError("", f"must be {wanted}, got {shown(value)}.")
        numbers = tuple(Number(self.unit, self.low, self.high).read(number) for number in value)
        if not self.normalised:
            return numbers
        length = float(np.linalg.norm(numbers))
        if length < 1e-9:
            raise SceneError("", f"has no length: {list(numbers)}; give a direction.")
        return tuple(number / length for number in numbers)

    def write(self, value: tuple[float, ...]) -> list[float]:
        """The numbers as a list."""
        return list(value)

    def schema(self) -> dict[str, Any]:
        """An array of numbers."""
        number = Number(self.unit, self.low, self.high).schema()
        return {"type": "array", "items": number, "minItems": min(self.sizes), "maxItems": max(self.sizes)}


@dataclass(frozen=True)
class Points(Kind):
    """Points (n, 3) [m] as a read-only array."""

    most: int

    def read(self, value: Any) -> NDArray[np.float64]:
        """The points as an array."""
        try:
            points = np.array(value, dtype=np.float64, order="C")
        except (TypeError, ValueError):
            points = np.empty(0)
        if points.ndim != 2 or points.shape[1] != 3 or not 1 <= len(points) <= self.most:
            raise SceneError("", f"must be 1 to {self.most:,} points [[x, y, z], ...] in metres.")
        bad = ~np.isfinite(points).all(axis=1)
        if bad.any():
            raise SceneError(
                "", f"{bad.sum()} of {len(points)} points are not finite, the first is number {bad.argmax()}."
            )
        points.setflags(write=False)
        return points

    def write(self, value: NDArray[np.float64]) -> Any:
        """The points as lists."""
        return value.tolist()

    def schema(self) -> dict[str, Any]:
        """An array of triples."""
        return {"type": "array", "items": Vector().schema(), "minItems": 1, "maxItems": self.most}


@dataclass(frozen=True)
class Indices(Kind):
    """Whole numbers from 0, as a read-only array (n,)."""

    most: int

    def read(self, value: Any) -> NDArray[np.int64]:
        """The numbers as an array."""
        try:
            numbers = np.array(value)
        except ValueError:
            numbers = np.empty(0)
        if numbers.ndim != 1 or not 1 <= len(numbers) <= self.most or numbers.dtype.kind not in "iu":
            raise SceneError("", f"must be 1 to {self.most:,} whole numbers.")
        if numbers.min() < 0:
            raise SceneError("", f"has {numbers.min()}; numbers begin at 0.")
        numbers = numbers.astype(np.int64)
        numbers.setflags(write=False)
        return numbers

    def write(self, value: NDArray[np.int64]) -> Any:
        """The numbers as a list."""
        return value.tolist()

    def schema(self) -> dict[str, Any]:
        """An array of integers."""
        return {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1, "maxItems": self.most}


@dataclass(frozen=True)
class Several(Kind):
    """A list of one kind, as a tuple."""

    kind: Kind
    most: int
    least: int = 0

    def read(self, value: Any) -> tuple[Any, ...]:
        """The items as a tuple."""
        if not isinstance(value, Sequence) or isinstance(value, str):
            raise SceneError("", f"must be a list, got {shown(value)}.")
        if not self.least <= len(value) <= self.most:
            raise SceneError("", f"has {len(value):,} items; allowed: {self.least:,} to {self.most:,}.")
        items = []
        for number, item in enumerate(value):
            try:
                items.append(self.kind.read(item))
            except SceneError as error:
                raise error.inside(f"[{number}]") from None
        return tuple(items)

    def write(self, value: tuple[Any, ...]) -> list[Any]:
        """The items as a list."""
        return [self.kind.write(item) for item in value]

    def schema(self) -> dict[str, Any]:
        """An array."""
        return {"type": "array", "items": self.kind.schema(), "minItems": self.least, "maxItems": self.most}


def shown(value: Any) -> str:
    """A value in a message, cut short; numbers that are not finite are named as what they are."""
    if isinstance(value, float) and not isfinite(value):
        return f"{value}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
