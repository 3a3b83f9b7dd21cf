"""How a file's numbers become metres: unit and scale, and where the camera and the object of a point cloud stood."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Self

from fingersplit.errors import ObjectFileError

__all__ = ["MAX_EXTENT", "MIN_EXTENT", "UNITS", "ObjectSource"]

UNITS: dict[str, float] = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
"""Length units that a file may be in [m]."""
MAX_EXTENT = 2.0
"""Most that the longest edge of an object's bounding box may be [m]."""
MIN_EXTENT = 0.002
"""Least that it may be [m]."""


@dataclass(frozen=True)
class ObjectSource:
    """What a caller says of an object's file.

    Attributes:
        unit: Length unit of the file's numbers, a key of `UNITS`.
        scale: Multiplies the file's numbers besides, as data sets give one with their meshes; positive.
        viewpoint: Where the camera stood that saw a point cloud, in the file's frame and unit; None for what the file
            says.
        support: Plane that the object of a point cloud stands on, so that the side which one view did not see is
            assumed: normal on the object's side and offset along it, in the file's frame and unit; None for what the
            file says.

    Raises:
        ObjectFileError: The unit is not known, the scale is not a positive number, the viewpoint has no three numbers,
            or the support no four.
    """

    unit: str = "m"
    scale: float = 1.0
    viewpoint: tuple[float, float, float] | None = None
    support: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            known = ", ".join(UNITS)
            raise ObjectFileError("unknown_unit", f"Unknown length unit {self.unit!r}; known units: {known}.")
        if not _is_number(self.scale) or self.scale <= 0:
            raise ObjectFileError("invalid_scale", f"The scale is {self.scale!r}; it must be a positive number.")
        object.__setattr__(self, "scale", float(self.scale))
        if self.viewpoint is not None:
            numbers = tuple(self.viewpoint)
            if len(numbers) != 3 or not all(_is_number(number) for number in numbers):
                raise ObjectFileError("non_finite", f"The viewpoint {list(numbers)} must be three numbers.")
            object.__setattr__(self, "viewpoint", tuple(float(number) for number in numbers))
        if self.support is not None:
            numbers = tuple(self.support)
            if len(numbers) != 4 or not all(_is_number(number) for number in numbers):
                raise ObjectFileError(
                    "non_finite", f"The support {list(numbers)} must be four numbers: a normal and an offset."
                )
            object.__setattr__(self, "support", tuple(float(number) for number in numbers))

    @property
    def meters(self) -> float:
        """Length of one of the file's numbers [m]."""
        return UNITS[self.unit] * self.scale

    def check_extent(self, extent: float) -> None:
        """Refuse an object whose bounding box has a longest edge [m] that no hand would meet.

        Raises:
            ObjectFileError: It is too large or too small; the text says which units would make it plausible.
        """
        if extent == 0.0:
            raise ObjectFileError("no_area", "All vertices lie at one point; an object needs a surface with an area.")
        if MIN_EXTENT <= extent <= MAX_EXTENT:
            return
        in_file = extent / self.meters * self.scale
        plausible = [
            f"{name!r} ({in_file * length:.3g} m)"
            for name, length in UNITS.items()
            if MIN_EXTENT <= in_file * length <= MAX_EXTENT
        ]
        advice = f"the unit may be {' or '.join(plausible)}" if plausible else "no known unit makes it plausible"
        scaled = "" if self.scale == 1.0 else f" and scale {self.scale:g}"
        raise ObjectFileError(
            "too_large" if extent > MAX_EXTENT else "too_small",
            f"The object is {extent:.3g} m in its largest extent with unit {self.unit!r}{scaled}; it must be between "
            f"{MIN_EXTENT:g} m and {MAX_EXTENT:g} m: {advice}, or it needs a scale.",
        )

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """The source that `to_document` wrote."""
        return cls(**document)

    def to_document(self) -> dict[str, Any]:
        """All values as plain JSON data."""
        lists = {"viewpoint": self.viewpoint, "support": self.support}
        return asdict(self) | {name: None if values is None else list(values) for name, values in lists.items()}


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value)
