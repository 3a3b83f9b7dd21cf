"""A description as a TOML file that a person reads and edits."""

from typing import Any

from fingersplit.hands.description import HandDescription

__all__ = ["description_to_toml"]

_HEADER = """# What the model beside this file cannot say. Lengths [m], angles [rad], torques [N m]; palm frame.
# `fingersplit hand check` says whether it is right.
"""


def description_to_toml(description: HandDescription, notes: tuple[str, ...] = ()) -> str:
    """The description, with notes as comments at its head."""
    data = description.model_dump(mode="json", exclude_defaults=True)
    data["model"] = description.model
    lines = [_HEADER, *(f"# {note}" for note in notes)]
    tables: list[str] = []
    for key, value in data.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            for entry in value:
                tables += ["", f"[[{key}]]", *_entries(entry, key)]
        elif isinstance(value, dict):
            tables += ["", f"[{key}]", *(f"{_key(name)} = {_value(item)}" for name, item in value.items())]
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    return "\n".join([*lines, *tables]) + "\n"


def _entries(entry: dict[str, Any], parent: str) -> list[str]:
    """Lines of one table of a list; preshapes and parked angles get tables of their own."""
    lines, below = [], []
    for key, value in entry.items():
        if key == "preshapes":
            for preshape in value:
                below += [
                    "",
                    f"[[{parent}.{key}]]",
                    *(f"{_key(name)} = {_value(item)}" for name, item in preshape.items()),
                ]
        elif key == "parked":
            below += ["", f"[{parent}.{key}]", *(f"{_key(name)} = {_value(item)}" for name, item in value.items())]
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    return lines + below


def _key(name: str) -> str:
    plain = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if plain else _text(name)


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)
