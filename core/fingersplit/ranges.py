"""Settings: fields of a dataclass that state a unit, a meaning and a range, and are held to it in one place."""

from collections.abc import Iterable, Mapping
from dataclasses import Field, field, fields
from typing import Any

from fingersplit.errors import SettingsError, suggestion

__all__ = ["check_known", "check_settings", "in_range", "setting"]

_KINDS: dict[type, str] = {float: "a number", int: "a whole number", bool: "true or false"}


def setting(default: float | None, unit: str, doc: str, low: float, high: float, **more: Any) -> Any:
    """A number with its unit, meaning and range.

    Args:
        default: Its type is the setting's: whole number, number, or true and false; None where it may be left open.
        unit: Empty or "1" for none.
        doc: What it means, in a sentence.
        low: Least allowed value.
        high: Largest allowed value.
        more: Other metadata of the field.
    """
    return field(default=default, metadata={"unit": unit, "doc": doc, "low": low, "high": high, **more})


def check_settings(settings: Any, label: str) -> None:
    """Hold every ``setting`` of a frozen dataclass to its type and range; whole numbers become numbers where asked.

    Args:
        settings: The instance, from its ``__post_init__``.
        label: What messages call a setting, with ``{}`` for its quoted name.

    Raises:
        SettingsError: A value of another type, or outside its range.
    """
    for one in fields(settings):
        value = getattr(settings, one.name)
        if "low" in one.metadata and not (value is None and one.default is None):
            object.__setattr__(settings, one.name, in_range(value, one, label.format(repr(one.name))))


def in_range(value: Any, allowed: "Field[Any]", label: str) -> Any:
    """A value of the type and in the range of a ``setting``.

    Raises:
        SettingsError: It is not; the message begins with ``label``.
    """
    kind: type[Any] = float if allowed.default is None else type(allowed.default)
    if type(value) not in ((float, int) if kind is float else (kind,)):
        raise SettingsError(f"{label} must be {_KINDS[kind]}, got {value!r}.")
    low, high, unit = (allowed.metadata[part] for part in ("low", "high", "unit"))
    if not low <= value <= high:
        raise SettingsError(
            f"{label} is {value!r}; allowed: {low:g} to {high:g}{f' {unit}' * (unit not in ('', '1'))}."
        )
    return kind(value)


def check_known(names: Iterable[str] | Mapping[str, Any], kind: Any, unknown: str, advice: str = "") -> None:
    """Refuse names that a dataclass of settings does not have.

    Args:
        names: What was given.
        kind: The dataclass or an instance.
        unknown: The message's beginning, with ``{}`` for the first unknown name, quoted.
        advice: A sentence after the known names.

    Raises:
        SettingsError: One is unknown; the message lists the known ones.
    """
    known = [one.name for one in fields(kind)]
    strange = sorted(set(names) - set(known))
    if strange:
        near = suggestion(strange[0], known)
        raise SettingsError(f"{unknown.format(repr(strange[0]))}; {near}{advice and ' '}{advice}")
