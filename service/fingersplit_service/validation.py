"""Faults of a request's fields, in words that name the field and what would be right."""

import difflib
from collections.abc import Mapping, MutableMapping
from typing import Any

from pydantic import BaseModel

__all__ = ["describe_fault", "pointer"]


def pointer(fault: Mapping[str, Any]) -> str:
    """``("body", "planner", "gain")`` as ``/planner/gain``; a parameter by its name, a body without JSON as ``""``."""
    if fault["type"] == "json_invalid":
        return ""
    source, *path = fault["loc"]
    return "".join(f"/{part}" for part in path) if source == "body" else str(path[-1] if path else source)


def describe_fault(fault: Mapping[str, Any], scope: MutableMapping[str, Any]) -> str:
    """What is wrong with one field, and what would be right."""
    kind, location = fault["type"], fault["loc"]
    if kind == "json_invalid":
        reason = fault.get("ctx", {}).get("error", fault["msg"])
        place = f" at character {location[-1]}" if isinstance(location[-1], int) else ""
        return f"The body is not JSON: {reason}{place}."
    if kind == "missing" and location == ("body",):
        return "A JSON body is needed, with Content-Type: application/json."
    if kind == "missing" and location == ("body", "file"):
        return "A file is needed: multipart/form-data, with curl -F file=@part.stl."
    if kind in ("model_attributes_type", "dict_type") and location == ("body",):
        return "The body must be a JSON object."
    if kind == "extra_forbidden":
        known = _known_fields(scope, location)
        near = difflib.get_close_matches(str(location[-1]), known, 1)
        hint = f" Did you mean {near[0]!r}?" if near else f" Known: {', '.join(known)}." if known else ""
        return f"Extra inputs are not permitted: there is no such field.{hint}"
    message: str = fault["msg"]
    return message.removeprefix("Value error, ").replace("valid dictionary", "JSON object")


def _known_fields(scope: MutableMapping[str, Any], location: tuple[str | int, ...]) -> list[str]:
    """The fields that stand where an unknown one was given."""
    body = getattr(scope.get("route"), "body_field", None)
    model: Any = scope.get("body_model") or getattr(getattr(body, "field_info", None), "annotation", None)
    for part in location[1:-1]:
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
