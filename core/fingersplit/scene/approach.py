"""How the hand comes and goes: directions, distances, retreat, with the names of moveit_msgs/GripperTranslation."""

from dataclasses import dataclass
from math import cos, pi
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import SceneError
from fingersplit.numerals import read_floats
from fingersplit.scene.entries import Document, Record, entry
from fingersplit.scene.kinds import Flag, Number, Several, Text, Vector

__all__ = ["Approach", "ApproachCone", "Retreat"]

MAX_CONES = 32

DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "down": (0.0, 0.0, -1.0),
    "up": (0.0, 0.0, 1.0),
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}
"""Directions of travel that have a name, in the scene's frame."""


@dataclass(frozen=True)
class ApproachCone(Document):
    """Directions of travel towards the object that are allowed: those within an angle of an axis."""

    axis: tuple[float, float, float] = entry(
        Vector((3,), "1", normalised=True), "Direction of travel in the middle of the cone."
    )
    max_angle: float = entry(
        Number("rad", 0.01, pi), "Largest angle between the axis and the direction of travel.", 0.6
    )
    frame: str = entry(Text(), 'Frame of the axis: the scene\'s, or "object".', "world")

    @classmethod
    def parse(cls, text: str) -> Self:
        """From ``down``, ``down:35`` (degrees) or ``-x:20``.

        Raises:
            SceneError: An unknown direction, or an angle that is no number or out of range.
        """
        name, _, angle = text.partition(":")
        if name not in DIRECTIONS:
            raise SceneError("approach", f"{name!r} is no direction; known: {', '.join(DIRECTIONS)}.")
        try:
            (degrees,) = read_floats([angle.encode() or b"35"])
        except ValueError:
            raise SceneError("approach", f"{angle!r} is no angle in degrees; write {name}:35, for example.") from None
        if not 0.6 <= degrees <= 180.0:
            raise SceneError("approach", f"has the angle {angle}; allowed: 0.6 to 180 degrees.")
        return cls(DIRECTIONS[name], degrees * pi / 180.0)


@dataclass(frozen=True)
class Retreat(Document):
    """Where the hand goes once it holds the object."""

    direction: tuple[float, float, float] = entry(
        Vector((3,), "1", normalised=True), "Direction of travel.", (0.0, 0.0, 1.0)
    )
    frame: str = entry(Text(), 'Frame of the direction: the scene\'s, "object" or "palm".', "world")
    desired_distance: float = entry(Number("m", 0.0, 1.0), "How far it should go.", 0.10)
    min_distance: float = entry(Number("m", 0.0, 1.0), "How far it must be free.", 0.02)

    def check(self) -> None:
        """The least distance is not the greater one."""
        if self.min_distance > self.desired_distance:
            raise SceneError(
                "min_distance", f"is {self.min_distance:g} m, more than desired_distance, {self.desired_distance:g} m."
            )


@dataclass(frozen=True)
class Approach(Document):
    """The straight way in."""

    directions: tuple[ApproachCone, ...] | None = entry(
        Several(Record(ApproachCone), MAX_CONES, 1),
        "Cones of allowed directions of travel; any one of them will do. All directions when left out.",
        None,
    )
    desired_distance: float = entry(Number("m", 0.0, 0.5), "How far away the approach should begin.", 0.10)
    min_distance: float = entry(Number("m", 0.0, 0.5), "How long the free way must be at least.", 0.03)
    required: bool = entry(Flag(), "Whether a grasp without a free straight approach counts as not feasible.", True)
    retreat: Retreat = entry(Record(Retreat), "Where the hand goes once it holds the object.", Retreat())

    def check(self) -> None:
        """The least distance is not the greater one."""
        if self.min_distance > self.desired_distance:
            raise SceneError(
                "min_distance", f"is {self.min_distance:g} m, more than desired_distance, {self.desired_distance:g} m."
            )

    def cones(self, world_from_object: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Axes (n, 3) in the object frame and cosines of the angles (n,) of all cones; empty when all is allowed."""
        given = self.directions or ()
        world_rotation = world_from_object[:3, :3]
        axes = [
            np.array(cone.axis) if cone.frame == "object" else world_rotation.T @ np.array(cone.axis) for cone in given
        ]
        return np.array(axes).reshape(-1, 3), np.array([cos(cone.max_angle) for cone in given])
