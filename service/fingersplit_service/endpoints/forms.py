"""Forms hold what they may hold, each field once: a misspelt unit must not become metres."""

import difflib
from email.errors import HeaderParseError
from email.header import decode_header, make_header
from pathlib import PurePosixPath
from urllib.parse import unquote

from fastapi import Request
from starlette.datastructures import UploadFile

from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["ExactForm", "file_name"]


class ExactForm:
    """A dependency that refuses unknown and repeated fields of a form.

    Args:
        fields: The fields that there are; by default those of the endpoint's parameters.
        repeated: Those of them that may come more than once.
    """

    def __init__(self, *fields: str, repeated: tuple[str, ...] = ()) -> None:
        self._fields, self._repeated = fields, repeated

    async def __call__(self, request: Request) -> None:
        """Look at a request's form.

        Raises:
            ProblemError: A field is unknown, or came twice.
        """
        media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if media_type != "multipart/form-data":
            detail = (
                f"The request's Content-Type is {media_type or 'missing'}; send a form with a file: "
                "multipart/form-data, with curl -F file=@part.stl."
            )
            raise ProblemError(ProblemKind.MEDIA_TYPE, detail)
        known = self._fields or _form_fields(request)
        names = [name for name, _ in (await request.form()).multi_items()]
        for name in names:
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                hint = f" Did you mean {near[0]!r}?" if near else ""
                detail = f"Unknown field {name!r}; known: {', '.join(known)}.{hint}"
                raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"/{name}")
            if names.count(name) > 1 and name not in self._repeated:
                detail = f"The field {name!r} came {names.count(name)} times; give it once."
                raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"/{name}")
        file = (await request.form()).get("file")
        if file is not None and not isinstance(file, UploadFile):
            detail = "The field 'file' is a text; send a file, with curl -F file=@part.stl."
            raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/file")


def _form_fields(request: Request) -> list[str]:
    """The form fields that the endpoint of a request declares, as they are called in forms."""
    fields = request.scope["route"].body_field.field_info.annotation.model_fields
    return [field.alias or name for name, field in fields.items()]


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
