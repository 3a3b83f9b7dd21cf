"""The description of a hand, ``hand.toml``: what the model file beside it cannot say. Validated, with a JSON Schema."""

import re
import tomllib
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from fingersplit.errors import HandError
from fingersplit.field_faults import fault_in_words, fields_at, unknown_field

__all__ = [
    "CouplingDescription",
    "FingerDescription",
    "GripDescription",
    "HandDescription",
    "PadDescription",
    "ShapeOptions",
    "description_schema",
    "read_description",
]

Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


def _nonzero(vector: Vector) -> Vector:
    if max(map(abs, vector)) < 1e-6:
        raise ValueError("a direction must not be zero")
    return vector


def _ordered(interval: tuple[float, float]) -> tuple[float, float]:
    if not interval[0] < interval[1]:
        raise ValueError("the first number must be below the second")
    return interval


Direction = Annotated[Vector, AfterValidator(_nonzero)]
Interval = Annotated[tuple[FiniteFloat, FiniteFloat], AfterValidator(_ordered)]
Name = Annotated[str, Field(min_length=1, max_length=200)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PadDescription(_Table):
    """A spherical cap that touches: a site of the model, or centre, normal and radius in a body's frame."""

    site: Name | None = Field(None, description="Site of the model: position, z axis out of the pad, first size.")
    body: Name | None = Field(None, description="Body whose frame the numbers below refer to.")
    center: Vector | None = Field(None, description="Centre of the pad's sphere [m].")
    normal: Direction | None = Field(None, description="Direction out of the middle of the pad.")
    radius: Annotated[float, Field(gt=0, le=0.2)] | None = Field(
        None, description="Radius of the pad's sphere [m]; a flat pad has a large one."
    )
    max_angle: Annotated[float, Field(gt=0, le=1.57)] | None = Field(
        None, description="Largest angle between pad normal and contact [rad]; the planner's own where none is given."
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        placed = (self.body, self.center, self.normal, self.radius)
        if self.site is None and None in placed:
            raise ValueError("a pad needs either site, or all of body, center, normal and radius")
        if self.site is not None and placed[:3] != (None, None, None):
            raise ValueError("a pad at a site takes no body, center or normal")
        return self


class FingerDescription(_Table):
    """A finger: the chain of joints from the palm to the body of its pads."""

    name: Name
    pads: list[PadDescription] = Field(min_length=1, description="Candidates, all on the finger's last link.")


class CouplingDescription(_Table):
    """A driven joint: angle = ratio * driver's angle + offset."""

    driver: Name = Field(description="Joint that it follows.")
    ratio: FiniteFloat = Field(description="Its angle by the driver's [1].")
    offset: FiniteFloat = Field(0.0, description="Its angle where the driver stands at zero [rad].")


class GripDescription(_Table):
    """Fingers that grasp together as the two jaws of a parallel gripper, the others parked; palm frame, SI."""

    jaws: tuple[list[Name], list[Name]] = Field(description="Fingers of the two jaws, at least three in all.")
    pads: dict[Name, int] = Field(default_factory=dict, description="Candidate of each finger; else its first.")
    jaw_axis: Direction = Field(description="From the second jaw to the first.")
    approach_axis: Direction = Field(description="Direction of travel towards the object, across the jaw axis.")
    center: tuple[FiniteFloat, FiniteFloat] = Field(
        description="Jaw centre along the lateral axis (jaw x approach) and the jaw axis [m]."
    )
    standoff: Interval = Field(description="Lowest and highest jaw centre along the approach axis [m].")
    opening: Interval = Field(description="Least and largest distance of the two jaw contacts [m].")
    preshapes: list[dict[Name, FiniteFloat]] = Field(
        min_length=1, description="Driver angles from which the mapping starts [rad]."
    )
    parked: dict[Name, FiniteFloat] = Field(
        default_factory=dict, description="Driver angles of the fingers that are held out of the way [rad]."
    )

    @model_validator(mode="after")
    def _fingers_once(self) -> Self:
        fingers = [*self.jaws[0], *self.jaws[1]]
        if not (self.jaws[0] and self.jaws[1]) or len(fingers) < 3:
            raise ValueError("two jaws with at least three fingers in all are needed")
        if len(set(fingers)) < len(fingers):
            raise ValueError("a finger may be in one jaw only, and once")
        return self


class ShapeOptions(_Table):
    """Which of the model's shapes count in collisions, and how many the planner works with."""

    groups: list[int] | None = Field(None, description="Geom groups that collide; else geoms whose contype says so.")
    budget: Annotated[int, Field(ge=1)] | None = Field(
        None, description="Most shapes; neighbours on a link are merged until there are no more."
    )


class HandDescription(_Table):
    """A hand beside its model file. Angles [rad], lengths [m], torques [N m]; palm frame = frame of the palm's body."""

    title: Annotated[str, Field(min_length=1, max_length=200)] = Field(description="Maker and model, for people.")
    model: Name = Field("hand.xml", description="MJCF or URDF file, relative to this description.")
    palm: Name = Field(description="Body (link) that carries the fingers; what is above it is cut off.")
    fingers: list[FingerDescription] = Field(min_length=3, description="In the order of every per-finger array.")
    grips: list[GripDescription] = Field(min_length=1, description="Active sets of fingers, the preferred one first.")
    torque_limits: dict[Name, Annotated[float, Field(gt=0)]] = Field(
        default_factory=dict, description="Largest torque of drivers [N m], where the model's is missing or wrong."
    )
    couplings: dict[Name, CouplingDescription] = Field(
        default_factory=dict, description="Driven joints, beside or instead of those that the model couples."
    )
    limits: dict[Name, Interval] = Field(default_factory=dict, description="Joint limits instead of the model's [rad].")
    fixed: dict[Name, FiniteFloat] = Field(
        default_factory=dict, description="Joints that do not move, and where [rad]."
    )
    shapes: ShapeOptions = Field(default_factory=lambda: ShapeOptions(groups=None, budget=None))
    drafted: bool = Field(False, description="Proposed by `fingersplit hand draft` and not looked at by a person.")

    @model_validator(mode="after")
    def _names_known(self) -> Self:
        names = [finger.name for finger in self.fingers]
        if len(set(names)) < len(names):
            raise ValueError("two fingers have the same name")
        pads = {finger.name: len(finger.pads) for finger in self.fingers}
        for grip in self.grips:
            for finger in [*grip.jaws[0], *grip.jaws[1], *grip.pads]:
                if finger not in pads:
                    raise ValueError(f"a grip names the finger {finger!r}; there are {', '.join(names)}")
            for finger, index in grip.pads.items():
                if not 0 <= index < pads[finger]:
                    raise ValueError(f"{finger!r} has pads 0 to {pads[finger] - 1}; a grip asks for {index}")
        return self


def read_description(text: str, origin: str) -> HandDescription:
    """The description in TOML; ``origin`` is named when it is wrong.

    Raises:
        HandError: Not TOML, an unknown or missing entry, or a value that cannot be.
    """
    try:
        return HandDescription.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"line \d+, column \d+", str(error))
        raise HandError(
            f"{origin} is not TOML: it cannot be read from {place[0] if place else 'its end'} on."
        ) from error
    except RecursionError as error:
        raise HandError(f"{origin} is nested too deeply.") from error
    except ValidationError as error:
        raise HandError(f"{origin}: {' '.join(map(_fault, error.errors()))}") from error


def description_schema() -> dict[str, Any]:
    """JSON Schema of a description, with units."""
    return HandDescription.model_json_schema()


def _fault(fault: Any) -> str:
    """A fault with its place, as ``grips.0.opening: ...``; of a list with its number, counted from 0."""
    *above, last = fault["loc"] or ["the description"]
    place = ".".join(map(str, [*above, last]))
    if fault["type"] == "extra_forbidden":
        return f"{place}: {unknown_field(str(last), fields_at(HandDescription, above))}"
    return f"{place}: {fault_in_words(fault, 'a table').rstrip('.')}."
