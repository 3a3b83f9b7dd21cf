"""The friction that is planned for: decided here and nowhere else.

What a request says counts before what is known of the object, and that before the default. Everything that plans forces
or cones (parallel grasps, ranking, metrics, the grip in a simulation, recordings) uses the number that comes out.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from fingersplit.objects.options import ObjectOptions
from fingersplit.ranges import in_range

__all__ = ["DEFAULT_FRICTION", "planned_friction", "without_friction"]

DEFAULT_FRICTION = 0.6
"""Coulomb friction between pads and object where nobody says otherwise."""

_RANGE = next(option for option in fields(ObjectOptions) if option.name == "friction")


def planned_friction(requested: float | None = None, known: float | None = None) -> float:
    """The Coulomb friction between pads and object to plan for.

    Args:
        requested: What the request asks for, None when it does not say.
        known: What is known of the object (``ObjectOptions.friction``) or stands in a stored result, None when nothing.

    Raises:
        SettingsError: A value that is no number or outside the range of the object option ``friction``.
    """
    return _checked(next((given for given in (requested, known) if given is not None), DEFAULT_FRICTION))


def without_friction(named: Mapping[str, Any]) -> tuple[dict[str, Any], float | None]:
    """Planner settings by name without ``friction``, and the friction that stood among them, None when none did.

    Friction is no setting of the splitting. Requests may still name it among the settings, as an alias of the
    request's friction.

    Raises:
        SettingsError: As ``planned_friction``.
    """
    rest = dict(named)
    return rest, _checked(rest.pop("friction")) if "friction" in rest else None


def _checked(value: Any) -> float:
    return float(in_range(value, _RANGE, "'friction'"))
