"""Faults of a request's fields, in words that name the field and what would be right."""

from collections.abc import Mapping, MutableMapping
from typing import Any

from fingersplit.field_faults import fault_in_words, fields_at, unknown_field

__all__ = ["describe_fault", "pointer"]


def pointer(fault: Mapping[str, Any]) -> str:
    """``("body", "planner", "gain")`` as ``/planner/gain``; a parameter by its name, a body without JSON as ``""``."""
    if fault["type"] == "json_invalid":
        return ""
    source, *path = fault["loc"]
    if source == "body":
        return "".join(f"/{part}" for part in path)
    return str(next((part for part in path if isinstance(part, str)), source))  # not the place in a list of values


def describe_fault(fault: Mapping[str, Any], scope: MutableMapping[str, Any]) -> str:
    """What is wrong with one field, and what would be right."""
    kind, location = fault["type"], fault["loc"]
    if kind == "json_invalid":
        place = f" at character {location[-1]}" if isinstance(location[-1], int) else ""
        return f"The body is not JSON: it breaks off, or breaks the rules{place}."
    if kind == "missing" and location == ("body",):
        return "A JSON body is needed, with Content-Type: application/json."
    if kind == "missing" and location == ("body", "file"):
        return "A file is needed: multipart/form-data, with curl -F file=@part.stl."
    if kind in ("model_attributes_type", "dict_type") and location == ("body",):
        return "The body must be a JSON object."
    if kind == "extra_forbidden":
        return unknown_field(str(location[-1]), _known_fields(scope, location))
    return fault_in_words(fault, "a JSON object")


def _known_fields(scope: MutableMapping[str, Any], location: tuple[str | int, ...]) -> list[str]:
    """The fields that stand where an unknown one was given."""
    body = getattr(scope.get("route"), "body_field", None)
    model = scope.get("body_model") or getattr(getattr(body, "field_info", None), "annotation", None)
    return fields_at(model, location[1:-1])
