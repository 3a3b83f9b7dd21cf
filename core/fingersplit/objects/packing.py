"""Nested tuples and dataclasses of arrays and numbers as named arrays, and back."""

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

__all__ = ["frozen", "packed", "unpacked"]

Value = TypeVar("Value")


def packed(value: Any, prefix: str = "") -> dict[str, NDArray[Any]]:
    """Arrays by the path of their field, such as ``surface/grid/points``.

    Args:
        value: A named tuple or dataclass of arrays, numbers, tuples of numbers, and further such.
        prefix: Put before every path.
    """
    arrays = dict[str, NDArray[Any]]()
    for name in _parts(type(value)):
        part, path = getattr(value, name), prefix + name
        if _is_nested(type(part)):
            arrays.update(packed(part, path + "/"))
        else:
            arrays[path] = np.asarray(part)
    return arrays


def unpacked(kind: type[Value], arrays: dict[str, NDArray[Any]], prefix: str = "") -> Value:
    """What `packed` took apart, on the same arrays, by the type hints of its fields.

    Raises:
        KeyError: An array is missing.
    """
    hints = get_type_hints(kind)
    return kind(**{name: _part(hints[name], arrays, prefix + name) for name in _parts(kind)})


def frozen(value: Value) -> Value:
    """The same value, with all its arrays made read-only, as they are when they come from a file."""
    for name in _parts(type(value)):
        part = getattr(value, name)
        if isinstance(part, np.ndarray):
            part.setflags(write=False)
        elif _is_nested(type(part)):
            frozen(part)
    return value


def _part(hint: Any, arrays: dict[str, NDArray[Any]], path: str) -> Any:
    if isinstance(hint, type) and _is_nested(hint):
        return unpacked(hint, arrays, path + "/")
    if hint in (float, int, bool, str):
        return arrays[path].item()
    if get_origin(hint) is tuple:
        return tuple(arrays[path].tolist())
    return arrays[path]


def _is_nested(kind: type) -> bool:
    return is_dataclass(kind) or hasattr(kind, "_fields")


def _parts(kind: Any) -> list[str]:
    return [field.name for field in fields(kind)] if is_dataclass(kind) else list(kind._fields)
