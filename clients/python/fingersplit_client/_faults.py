"""Faults of options and documents, in words that say what would be right."""

import json
from collections.abc import Mapping
from typing import Any

__all__ = ["fault_in_words"]

_KINDS = {
    "missing": "it is needed",
    "extra_forbidden": "there is no such field",
    "bool_parsing": "it must be true or false",
    "bool_type": "it must be true or false",
    "string_type": "it must be a text",
    "string_too_short": "it must have at least {min_length} characters",
    "string_too_long": "it must have at most {max_length} characters",
    "string_pattern_mismatch": "it must match {pattern}",
    "int_type": "it must be a whole number",
    "int_parsing": "it must be a whole number",
    "int_from_float": "it must be a whole number, without a fraction",
    "float_type": "it must be a number",
    "float_parsing": "it must be a number",
    "finite_number": "it must be a finite number",
    "greater_than": "it must be greater than {gt}",
    "greater_than_equal": "it must be {ge} or more",
    "less_than": "it must be less than {lt}",
    "less_than_equal": "it must be {le} or less",
    "literal_error": "it must be {expected}",
    "enum": "it must be {expected}",
    "list_type": "it must be a list",
    "tuple_type": "it must be a list",
    "too_short": "it must have at least {min_length} entries",
    "too_long": "it must have at most {max_length} entries",
    "dict_type": "it must be names with values",
    "model_type": "it must be names with values",
    "model_attributes_type": "it must be names with values",
    "json_invalid": "it is no JSON, or was cut off",
}
"""What would be right, by kind of fault; names in braces are what the fault itself says."""
_SHOWN = 60
"""Characters of a wrong value that are quoted."""


def fault_in_words(fault: Mapping[str, Any]) -> str:
    """One of ``ValidationError.errors()``: what would be right, and the value that was given where it is short."""
    message = _KINDS.get(fault["type"])
    if message is None:
        right = str(fault["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ").rstrip(".")
    else:
        right = message.format_map(fault.get("ctx", {}))
    given = fault.get("input")
    if fault["type"] in ("missing", "json_invalid") or given is None or isinstance(given, bytes):
        return f"{right}."
    value = json.dumps(given, default=str)
    return f"{right}; it is {value}." if len(value) <= _SHOWN else f"{right}."
