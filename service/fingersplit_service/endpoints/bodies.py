"""JSON bodies say everything once: of a key that comes twice, which value is meant is not for the service to choose."""

import json
from typing import Any

from fastapi import Request

from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["exact_json"]


async def exact_json(request: Request) -> None:
    """A dependency that refuses JSON bodies with a repeated key.

    Raises:
        ProblemError: A key stands twice in one object of the body.
    """
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type != "application/json" and not media_type.endswith("+json"):
        return
    body = await request.body()
    try:
        place = _repeated(json.loads(body, object_pairs_hook=_Pairs), "")
    except (ValueError, RecursionError):  # no JSON; the endpoint says so
        return
    if place is not None:
        detail = f"The key {place.rpartition('/')[2]!r} comes more than once in one JSON object; give it once."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=place)


class _Pairs(list[tuple[str, Any]]):
    """A JSON object as its keys and values, in the order they came."""


def _repeated(value: Any, place: str) -> str | None:
    """The pointer of the first key that stands twice in one object; None without one."""
    if isinstance(value, _Pairs):
        names = set[str]()
        for name, inner in value:
            if name in names:
                return f"{place}/{name}"
            names.add(name)
            found = _repeated(inner, f"{place}/{name}")
            if found is not None:
                return found
    elif isinstance(value, list) and value and isinstance(value[0], list):  # of objects or of lists
        return next(filter(None, (_repeated(inner, f"{place}/{i}") for i, inner in enumerate(value))), None)
    return None
