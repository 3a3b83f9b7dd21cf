"""Values by name on the command line: ``NAME=VALUE``."""

import json
from typing import Any

from fingersplit.errors import SettingsError

__all__ = ["named_values"]


def named_values(pairs: list[str] | None) -> dict[str, Any]:
    """Values by name from ``NAME=VALUE`` texts.

    Raises:
        SettingsError: A text of another form, or a name that is given twice.
    """
    values: dict[str, Any] = {}
    for pair in pairs or []:
        name, separator, text = pair.partition("=")
        if name in values:
            raise SettingsError(f"{name!r} is given twice.")
        try:
            values[name] = json.loads(text)
        except json.JSONDecodeError:
            if not separator or not text.isidentifier():
                message = f"Setting {pair!r} is not NAME=VALUE with a number, true, false or a word."
                raise SettingsError(message) from None
            values[name] = text
    return values
