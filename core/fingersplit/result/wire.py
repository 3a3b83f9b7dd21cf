"""Frozen dataclasses as JSON documents: how every part of a result is written and read, once for all of them.

The type hints of a dataclass say what a document holds, the metadata of its fields what that means (``doc``) and in
which unit. The schemas of the client are generated from the same two (``fingersplit.result.schema``). Properties that
a class names in ``computed`` are written, too; what a document says of them is not read.
"""

import math
from collections.abc import Callable
from dataclasses import MISSING, field, fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from fingersplit.errors import FingersplitError, ResultError

__all__ = ["Json", "Quaternion", "Vector3", "described", "from_dict", "to_dict"]

Vector3 = tuple[float, float, float]
"""Three numbers along x, y, z."""
Quaternion = tuple[float, float, float, float]
"""A unit quaternion, w first."""
Json = Any
"""Whatever JSON can hold."""

_Part = TypeVar("_Part")
_Writer = Callable[[Any], Any]
_Reader = Callable[[Any, str], Any]
_SCALARS = {str: "a text", bool: "true or false", int: "a whole number", float: "a finite number"}


def described(doc: str, unit: str = "", *, default: Any = MISSING, examples: list[Any] | None = None) -> Any:
    """A field of a result with its meaning and unit.

    Args:
        doc: What it means, without the unit and without a full stop.
        unit: Unit as it stands in brackets, such as ``"m"``; empty for none.
        default: Value where a document does not have it; required when left out.
        examples: For the API's documentation.
    """
    metadata = {"doc": doc, "unit": unit, "examples": examples}
    return field(metadata=metadata) if default is MISSING else field(default=default, metadata=metadata)


def to_dict(part: Any) -> dict[str, Any]:
    """A dataclass as plain JSON data, field for field."""
    kind: Any = type(part)
    document: dict[str, Any] = _write_part(kind)(part)
    return document


def from_dict(kind: type[_Part], document: Any, place: str = "") -> _Part:
    """The dataclass of a document.

    Args:
        kind: The dataclass.
        document: What ``to_dict`` gave, as it came back from JSON.
        place: Where the document stands in a larger one, for messages.

    Raises:
        ResultError: A field is missing, unknown or of another type; the message names it.
    """
    known: Any = kind
    part: _Part = _read_part(known)(document, place)
    return part


@cache
def _write_part(kind: type) -> _Writer:
    hints = get_type_hints(kind)
    writers = [(part.name, _writer(hints[part.name])) for part in fields(kind)]
    writers += [(name, None) for name in getattr(kind, "computed", ())]

    def write(part: Any) -> dict[str, Any]:
        return {
            name: getattr(part, name) if writer is None else writer(getattr(part, name)) for name, writer in writers
        }

    return write


def _writer(kind: Any) -> _Writer | None:
    """How a value of this type is written; None where it is JSON already."""
    if is_dataclass(kind):
        assert isinstance(kind, type)
        return _write_part(kind)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return lambda value: value.name.lower()
    if get_origin(kind) in (Union, UnionType) and sum(map(is_dataclass, get_args(kind))) > 1:
        return lambda value: None if value is None else to_dict(value)
    inner = [_writer(argument) for argument in get_args(kind) if argument not in (Ellipsis, NoneType)]
    item = next((writer for writer in inner if writer is not None), None)
    if get_origin(kind) is tuple:
        return list if item is None else lambda values: [item(value) for value in values]
    if item is None:
        return None
    if get_origin(kind) is dict:
        return lambda values: {name: item(value) for name, value in values.items()}
    return lambda value: None if value is None else item(value)


@cache
def _read_part(kind: type) -> _Reader:
    hints = get_type_hints(kind)
    readers = {part.name: _reader(hints[part.name]) for part in fields(kind)}
    computed = set(getattr(kind, "computed", ()))
    required = {part.name for part in fields(kind) if part.default is MISSING and part.default_factory is MISSING}

    def read(document: Any, place: str) -> Any:
        if not isinstance(document, dict):
            raise _wrong(place, "an object with named fields", document)
        missing = sorted(required - document.keys())
        unknown = sorted(document.keys() - readers.keys() - computed)
        if missing:
            raise ResultError(f"{place or 'The document'} lacks {missing[0]!r}.")
        if unknown:
            raise ResultError(f"{place or 'The document'} has {unknown[0]!r}, which this version does not know.")
        values = {
            name: readers[name](value, f"{place}.{name}".lstrip("."))
            for name, value in document.items()
            if name in readers
        }
        try:
            return kind(**values)
        except ResultError:
            raise
        except FingersplitError as error:  # a value out of its range
            raise ResultError(f"{place}: {error}") from error

    return read


def _reader(kind: Any) -> _Reader:
    if is_dataclass(kind):
        assert isinstance(kind, type)
        return _read_part(kind)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return _choice_reader({value.name.lower(): value for value in kind})
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is tuple:
        return _tuple_reader(arguments)
    if origin is dict:
        return _dict_reader(_reader(arguments[1]))
    if origin in (Union, UnionType):
        return _union_reader([_reader(one) for one in arguments if one is not NoneType], NoneType in arguments)
    if origin is Literal:
        return _choice_reader({value: value for value in arguments})
    return (lambda value, _place: value) if kind is Json else _scalar_reader(kind)


def _scalar_reader(kind: Any) -> _Reader:
    def read(value: Any, place: str) -> Any:
        if type(value) is kind and (kind is not float or math.isfinite(value)):
            return value
        if kind is float and type(value) is int:  # JSON writes 1.0 as 1 in some languages
            return float(value)
        raise _wrong(place, _SCALARS[kind], value)

    return read


def _choice_reader(choices: dict[str, Any]) -> _Reader:
    def read(value: Any, place: str) -> Any:
        if not isinstance(value, str) or value not in choices:
            raise _wrong(place, " or ".join(repr(name) for name in choices), value)
        return choices[value]

    return read


def _tuple_reader(kinds: tuple[Any, ...]) -> _Reader:
    item, count = _reader(kinds[0]), None if kinds[-1] is Ellipsis else len(kinds)

    def read(values: Any, place: str) -> Any:
        if not isinstance(values, list | tuple) or count not in (None, len(values)):
            raise _wrong(place, "a list" if count is None else f"a list of {count}", values)
        return tuple([item(value, f"{place}[{i}]") for i, value in enumerate(values)])

    return read


def _dict_reader(item: _Reader) -> _Reader:
    def read(values: Any, place: str) -> Any:
        if not isinstance(values, dict):
            raise _wrong(place, "an object with named values", values)
        return {name: item(value, f"{place}.{name}") for name, value in values.items()}

    return read


def _union_reader(readers: list[_Reader], optional: bool) -> _Reader:
    """The first of several types that fits; messages are those of the last one."""

    def read(value: Any, place: str) -> Any:
        if value is None and optional:
            return None
        for reader in readers[:-1]:
            try:
                return reader(value, place)
            except ResultError:
                continue
        return readers[-1](value, place)

    return read


def _wrong(place: str, expected: str, value: Any) -> ResultError:
    found = repr(value)
    return ResultError(f"{place or 'The document'} must be {expected}; it is {found[:60]}{'...' * (len(found) > 60)}.")
