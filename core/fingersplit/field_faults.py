"""Faults that pydantic finds, in words that say what would be right: of requests, of options, and of `hand.toml`."""

import difflib
import json
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel

__all__ = ["fault_in_words", "fields_at", "unknown_field"]

_KINDS = {
    "missing": "This field is needed.",
    "extra_forbidden": "There is no such field.",
    "json_invalid": "It is not JSON, or was cut off.",
    "bool_parsing": "It must be true or false.",
    "bool_type": "It must be true or false.",
    "string_type": "It must be a text.",
    "string_too_short": "It must have at least {min_length} characters.",
    "string_too_long": "It must have at most {max_length} characters.",
    "string_pattern_mismatch": "The text has characters or a form that are not allowed here; it must match {pattern}.",
    "int_type": "It must be a whole number.",
    "int_parsing": "It must be a whole number.",
    "int_parsing_size": "It must be a whole number of fewer digits.",
    "int_from_float": "It must be a whole number, without a fraction.",
    "float_type": "It must be a number.",
    "float_parsing": "It must be a number.",
    "finite_number": "It must be a finite number.",
    "greater_than": "It must be greater than {gt}.",
    "greater_than_equal": "It must be {ge} or more.",
    "less_than": "It must be less than {lt}.",
    "less_than_equal": "It must be {le} or less.",
    "multiple_of": "It must be a multiple of {multiple_of}.",
    "enum": "It must be {expected}.",
    "literal_error": "It must be {expected}.",
    "list_type": "It must be a list.",
    "tuple_type": "It must be a list.",
    "too_short": "It must have at least {min_length} entries, and has {actual_length}.",
    "too_long": "It must have at most {max_length} entries, and has more.",
    "dict_type": "It must be {table}.",
    "model_type": "It must be {table}.",
    "model_attributes_type": "It must be {table}.",
    "none_required": "It must be null.",
    "union_tag_not_found": "It needs the field {discriminator}, which says what it is.",
    "union_tag_invalid": "{discriminator} is {tag!r}; it must be {expected_tags}.",
    "date_from_datetime_parsing": "It must be a date, such as 2026-01-31.",
    "datetime_parsing": "It must be a date and time, such as 2026-01-31T12:00:00Z.",
    "datetime_from_date_parsing": "It must be a date and time, such as 2026-01-31T12:00:00Z.",
    "uuid_parsing": "It must be an id: 32 hexadecimal digits.",
    "json_type": "It must be JSON text.",
}
"""What would be right, by kind of fault; names in braces are what the fault itself says."""
_SHOWN = 60
"""Characters of a wrong value that are quoted."""


def fault_in_words(fault: Mapping[str, Any], table: str) -> str:
    """A fault of a known kind, with the value that was given where that is short; others as their validator says.

    Args:
        fault: One of ``ValidationError.errors()``.
        table: What names with values are called where the fault is: ``a JSON object``, ``a table``.
    """
    kind = fault["type"]
    if kind == "missing" and isinstance(fault["loc"][-1], int):
        return f"The list is too short: it has no entry {fault['loc'][-1]}, counted from 0."
    if kind in ("string_too_short", "too_short") and fault.get("ctx", {}).get("min_length") == 1:
        return "It must not be empty."
    message = _KINDS.get(kind)
    if message is None:
        return str(fault["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    try:
        right = message.format_map({"table": table, **fault.get("ctx", {})})
    except KeyError:  # the fault came without what the sentence quotes
        right = message.partition(" {")[0] + "."
    given = fault.get("input")
    if (
        kind in ("missing", "extra_forbidden", "json_invalid")
        or given is None
        or isinstance(given, (dict, list, tuple, bytes))
    ):
        return right
    value = json.dumps(given, default=str)
    return f"{right} It is {value}." if len(value) <= _SHOWN else right


def unknown_field(name: str, known: Iterable[str]) -> str:
    """That there is no such field, with the one that is spelt most like it, or all of them."""
    names = list(known)
    near = difflib.get_close_matches(name, names, 1)
    hint = f" Did you mean {near[0]!r}?" if near else f" Known: {', '.join(names)}." if names else ""
    return f"There is no such field.{hint}"


def fields_at(model: Any, path: Iterable[str | int]) -> list[str]:
    """The fields that a model has where a path of names and indexes leads; none where nothing is known."""
    for part in path:
        if isinstance(part, int):
            continue
        known = model.model_fields if _is_model(model) else {}
        model = _model_in(known[part].annotation) if part in known else None
    return list(model.model_fields) if _is_model(model) else []


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _model_in(annotation: Any) -> Any:
    """The model in an annotation such as ``list[Model]`` or ``Model | None``; None without one."""
    if _is_model(annotation):
        return annotation
    return next(filter(None, map(_model_in, getattr(annotation, "__args__", ()))), None)
