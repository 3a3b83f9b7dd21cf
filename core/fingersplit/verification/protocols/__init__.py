"""The presets: every module of this folder that defines a ``Protocol`` is one."""

from functools import cache
from typing import Any

from fingersplit.errors import SettingsError, suggestion
from fingersplit.registry import find_classes_by_name
from fingersplit.verification.protocol import Protocol

__all__ = ["available_protocols", "load_protocol"]


@cache
def available_protocols() -> dict[str, Protocol]:
    """Every preset by name."""
    return {name: preset() for name, preset in find_classes_by_name(__name__, Protocol).items()}


def load_protocol(name: str, values: dict[str, Any] | None = None) -> Protocol:
    """A preset, with some of its numbers replaced.

    Raises:
        SettingsError: No such preset, or no such number; the message lists the known ones.
    """
    presets = available_protocols()
    if name not in presets:
        raise SettingsError(f"Unknown verification protocol {name!r}; {suggestion(name, presets)}")
    return presets[name].with_values(values) if values else presets[name]
