"""What is not known exactly when a grasp is executed: where the object is, how slippery, how heavy."""

from dataclasses import dataclass
from functools import cached_property
from math import radians, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import SettingsError

__all__ = ["DEFAULT_POSITION", "DEFAULT_ROTATION", "Draws", "NoiseModel"]

DEFAULT_POSITION, DEFAULT_ROTATION = 5e-3, radians(5.0)
"""Root mean square of the object's displacement [m] and turn [rad], over all axes together."""
MAX_POSITION, MAX_ROTATION = 0.05, 0.8
FRICTION_RANGE, MASS_RANGE = (2 / 3, 4 / 3), (0.7, 1.4)
"""Factors of the planned friction, which make 0.6 a friction of 0.4 to 0.8, and of the mass, drawn evenly."""


class Draws(NamedTuple):
    """Samples of what an execution may meet.

    Attributes:
        displacements: Of the object's centre of mass, along the axes of the object frame, (D, 3) [m].
        turns: Of the object about its centre of mass, rotation vectors, (D, 3) [rad].
        frictions: Factors of the planned friction, (D,).
        masses: Factors of the mass, (D,).
    """

    displacements: NDArray[np.float64]
    turns: NDArray[np.float64]
    frictions: NDArray[np.float64]
    masses: NDArray[np.float64]


@dataclass(frozen=True)
class NoiseModel:
    """How far the executed grasp may be from the planned one.

    Attributes:
        position: Root mean square displacement of the object, all axes together [m].
        rotation: Root mean square turn of the object, all axes together [rad].

    Raises:
        SettingsError: A value outside its range.
    """

    position: float = DEFAULT_POSITION
    rotation: float = DEFAULT_ROTATION

    def __post_init__(self) -> None:
        for name, unit, value, most in (
            ("position", "m", self.position, MAX_POSITION),
            ("rotation", "rad", self.rotation, MAX_ROTATION),
        ):
            if not 0.0 <= value <= most:
                raise SettingsError(f"The noise's {name} is {value!r}; it must be 0 to {most:g} {unit}.")

    @classmethod
    def of(cls, position: float | None, rotation: float | None) -> "NoiseModel":
        """The default one where nothing is given."""
        return cls(
            DEFAULT_POSITION if position is None else position, DEFAULT_ROTATION if rotation is None else rotation
        )

    @classmethod
    def per_axis(cls, position: float, rotation: float) -> "NoiseModel":
        """From standard deviations on each axis [m], [rad]."""
        return cls(sqrt(3.0) * position, sqrt(3.0) * rotation)

    @cached_property
    def level(self) -> float:
        """Size of the noise by the default one, position and rotation in the mean."""
        return 0.5 * (self.position / DEFAULT_POSITION + self.rotation / DEFAULT_ROTATION)

    def draw(self, count: int, seed: int) -> Draws:
        """Independent samples; the same arguments give the same ones."""
        rng = np.random.default_rng(seed)
        return Draws(
            rng.normal(0.0, self.position / sqrt(3.0), (count, 3)),
            rng.normal(0.0, self.rotation / sqrt(3.0), (count, 3)),
            rng.uniform(*FRICTION_RANGE, count),
            rng.uniform(*MASS_RANGE, count),
        )

    def to_document(self) -> dict[str, Any]:
        """The noise as plain JSON data."""
        return {
            "position": self.position,
            "rotation": self.rotation,
            "friction_factors": list(FRICTION_RANGE),
            "mass_factors": list(MASS_RANGE),
        }
