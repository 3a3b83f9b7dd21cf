"""The presets: every module of this folder that defines a ``Protocol`` is one."""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from fingersplit.errors import SettingsError, suggestion
from fingersplit.verification.protocol import Protocol

__all__ = ["available_protocols", "load_protocol"]


@cache
def available_protocols() -> dict[str, Protocol]:
    """Every preset by name."""
    found: dict[str, Protocol] = {}
    for module in iter_modules(__path__):
        for value in vars(import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, type) and issubclass(value, Protocol) and value is not Protocol:
                found[value.name] = value()
    return dict(sorted(found.items()))


def load_protocol(name: str, values: dict[str, Any] | None = None) -> Protocol:
    """A preset, with some of its numbers replaced.

    Raises:
        SettingsError: No such preset, or no such number; the message lists the known ones.
    """
    presets = available_protocols()
    if name not in presets:
        raise SettingsError(f"Unknown verification protocol {name!r}; {suggestion(name, presets)}")
    return presets[name].with_values(values or {})
