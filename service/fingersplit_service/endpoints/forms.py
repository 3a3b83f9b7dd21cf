"""Forms and queries hold what they may hold, each field once: a misspelt unit must not become metres."""

import difflib
import json
from collections.abc import Iterable, Iterator
from email.errors import HeaderParseError
from email.header import decode_header, make_header
from pathlib import PurePosixPath
from typing import Any, get_args, get_origin
from urllib.parse import unquote

from fastapi import Request
from fastapi.dependencies.models import Dependant
from starlette.datastructures import UploadFile

from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["ExactForm", "exact_query", "file_name"]


class ExactForm:
    """A dependency that refuses unknown and repeated fields of a form, and numbers with underscores.

    Args:
        fields: The fields that there are; by default those of the endpoint's parameters.
        repeated: Those of them that may come more than once.
    """

    def __init__(self, *fields: str, repeated: tuple[str, ...] = ()) -> None:
        self._fields, self._repeated = fields, repeated

    async def __call__(self, request: Request) -> None:
        """Look at a request's form.

        Raises:
            ProblemError: A field is unknown, or came twice, or a number is none.
        """
        media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if media_type != "multipart/form-data":
            detail = (
                f"The request's Content-Type is {media_type or 'missing'}; send a form with a file: "
                "multipart/form-data, with curl -F file=@part.stl."
            )
            raise ProblemError(ProblemKind.MEDIA_TYPE, detail)
        items = (await request.form()).multi_items()
        _check_names("field", [name for name, _ in items], self._fields or _form_fields(request), self._repeated, "/")
        for name, value in items:
            if name == "file" and not isinstance(value, UploadFile):
                detail = "The field 'file' is a text; send a file, with curl -F file=@part.stl."
                raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/file")
            if value == "" and name not in _MAY_BE_EMPTY:  # a default instead would turn a lost unit into metres
                detail = f"The field {name!r} is empty; give it a value or leave it out."
                raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"/{name}")
            if isinstance(value, str) and "_" in value and name in _numbers_of_form(request):
                raise _no_number(value, f"/{name}")


_MAY_BE_EMPTY = ("name",)


async def exact_query(request: Request) -> None:
    """A dependency that refuses unknown and repeated query parameters, and numbers with underscores.

    Raises:
        ProblemError: A parameter is unknown, or came twice, or a number is none.
    """
    names = [name for name, _ in request.query_params.multi_items()]
    if not names:
        return
    known = {field.alias: field for field in _query_fields(request.scope["route"].dependant)}
    lists = [alias for alias, field in known.items() if _takes_list(field.field_info.annotation)]
    _check_names("query parameter", names, known, lists)
    for name, value in request.query_params.multi_items():
        if "_" in value and _takes_number(known[name].field_info.annotation):
            raise _no_number(value, name)


def _check_names(what: str, names: list[str], known: Iterable[str], repeated: Iterable[str], prefix: str = "") -> None:
    """Refuse names that are unknown, or that came twice without being among the ``repeated``."""
    known = list(known)
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            detail = f"Unknown {what} {name!r}; known: {', '.join(known) or 'none'}.{hint}"
            raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"{prefix}{name}")
        if names.count(name) > 1 and name not in repeated:
            detail = f"The {what} {name!r} came {names.count(name)} times; give it once."
            raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"{prefix}{name}")


def _takes_list(annotation: Any) -> bool:
    return any(get_origin(each) is list for each in (annotation, *get_args(annotation)))


def _takes_number(annotation: Any) -> bool:
    return annotation in (int, float) or any(map(_takes_number, get_args(annotation)))


def _no_number(value: str, field: str) -> ProblemError:
    """Pydantic takes ``4_0`` for 40, as Python does."""
    detail = f"{field}: It must be a number. It is {json.dumps(value)}."
    return ProblemError(ProblemKind.INVALID_REQUEST, detail, field=field)


def _query_fields(dependant: Dependant) -> Iterator[Any]:
    """The query parameters of an endpoint and of what it depends on."""
    yield from dependant.query_params
    for each in dependant.dependencies:
        yield from _query_fields(each)


def _form_fields(request: Request) -> list[str]:
    """The form fields that the endpoint of a request declares, as they are called in forms."""
    fields = request.scope["route"].body_field.field_info.annotation.model_fields
    return [field.alias or name for name, field in fields.items()]


def _numbers_of_form(request: Request) -> set[str]:
    """Those of them that are numbers."""
    fields = request.scope["route"].body_field.field_info.annotation.model_fields
    return {field.alias or name for name, field in fields.items() if _takes_number(field.annotation)}


def file_name(file: UploadFile) -> str:
    """What a client calls a file, whichever way the name is encoded (RFC 2047, RFC 5987, percent signs)."""
    name = file.filename or ""
    if "=?" in name:
        try:
            name = str(make_header(decode_header(name)))
        except (HeaderParseError, LookupError, ValueError):
            name = ""
    if name.lower().startswith("utf-8''"):
        name = unquote(name[len("utf-8''") :])
    return PurePosixPath(name.replace("\\", "/")).name
