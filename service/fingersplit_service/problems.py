"""Errors as problem documents (RFC 9457): one stable type for each kind, and how exceptions become them."""

import logging
import math
import time
import zlib
from enum import Enum
from typing import Any

import sqlalchemy as sa
from fastapi import FastAPI, HTTPException, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.routing import Route

from fingersplit_client.schemas import InvalidField, Problem
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.jobs import IdempotencyConflict, QueueFull
from fingersplit_service.database.usage import LimitReached
from fingersplit_service.jobs import errors
from fingersplit_service.jobs.notifier import TooManyWaiting
from fingersplit_service.jobs.slot import DeadlineExceeded, WorkerDied
from fingersplit_service.operations.health import DiskFull
from fingersplit_service.validation import describe_fault, pointer

__all__ = [
    "MEDIA_TYPE",
    "ProblemError",
    "ProblemKind",
    "add_problem_handlers",
    "problem_answers",
    "problem_response",
]

MEDIA_TYPE = "application/problem+json"
_log = logging.getLogger(__name__)


class ProblemKind(Enum):
    """Kinds of problems: the last part of the type's URI, the HTTP status and the title."""

    BAD_REQUEST = ("bad-request", 400, "The request cannot be read")
    UNAUTHENTICATED = ("unauthenticated", 401, "Authentication required")
    FORBIDDEN = ("forbidden", 403, "Permission denied")
    NOT_FOUND = ("not-found", 404, "Not found")
    METHOD_NOT_ALLOWED = ("method-not-allowed", 405, "Method not allowed")
    TOO_SLOW = ("too-slow", 408, "Request timeout")
    NOT_FINISHED = ("not-finished", 409, "The job has not ended yet")
    IN_USE = ("in-use", 409, "The resource is in use")
    GONE = ("gone", 409, "The resource is gone")
    TOO_LARGE = ("too-large", 413, "The request is too large")
    MEDIA_TYPE = ("unsupported-media-type", 415, "Unsupported media type")
    UNKNOWN_FORMAT = ("unknown-format", 415, "Unknown file format")
    INVALID_REQUEST = ("invalid-request", 422, "The request is not valid")
    INVALID_MESH = ("invalid-mesh", 422, "The file holds no graspable object")
    KEY_REUSED = ("idempotency-key-reused", 422, "The idempotency key belongs to another request")
    HEADERS_TOO_LARGE = ("headers-too-large", 431, "Request header fields too large")
    TOO_MANY_WAITING = ("too-many-waiting", 429, "Too many requests are waiting")
    OVERLOADED = ("overloaded", 503, "The service is overloaded")
    QUEUE_FULL = ("queue-full", 429, "Too many jobs are waiting")
    LIMIT_REACHED = ("limit-reached", 429, "A limit is reached")
    INTERNAL = ("internal-error", 500, "Internal error")
    NOT_READY = ("not-ready", 503, "The service is not ready")
    STORAGE = ("storage-unavailable", 503, "Storage unavailable")
    WORKER_FAILED = ("worker-failed", 503, "The worker failed")

    def __init__(self, slug: str, status: int, title: str) -> None:
        self.uri = f"urn:fingersplit:problem:{slug}"
        self.status = status
        self.title = title

    def document(self, detail: str, **members: Any) -> Problem:
        """The problem document of one occurrence."""
        return Problem(type=self.uri, title=self.title, status=self.status, detail=detail, **members)


class ProblemError(HTTPException):
    """Ends a request with a problem document.

    Args:
        kind: The kind of problem.
        detail: What is wrong here and what would be right.
        field: The offending field, if it is one.
        retry_after: When it may work [s], where that is known.
        members: Further members of the document: ``code``, ``valid``, ``limit``.
    """

    def __init__(
        self,
        kind: ProblemKind,
        detail: str,
        *,
        field: str | None = None,
        retry_after: int | None = None,
        **members: Any,
    ) -> None:
        errors = [InvalidField(field=field, detail=detail)] if field else []
        self.problem = kind.document(detail, errors=errors, **members)
        headers = {"WWW-Authenticate": "Bearer"} if kind is ProblemKind.UNAUTHENTICATED else {}
        if retry_after is not None:
            headers["Retry-After"] = str(retry_after)
        super().__init__(kind.status, detail, headers)


_EVERYWHERE = (
    ProblemKind.BAD_REQUEST,
    ProblemKind.UNAUTHENTICATED,
    ProblemKind.FORBIDDEN,
    ProblemKind.TOO_SLOW,
    ProblemKind.TOO_LARGE,
    ProblemKind.MEDIA_TYPE,
    ProblemKind.HEADERS_TOO_LARGE,
    ProblemKind.INTERNAL,
    ProblemKind.STORAGE,
    ProblemKind.OVERLOADED,
)
_PROBLEM_REFERENCE = {"$ref": "#/components/schemas/Problem"}


_UNREADABLE = {
    "Missing boundary in multipart.": "The form's Content-Type names no boundary: multipart/form-data; boundary=...; "
    "clients such as curl -F set it themselves.",
    "Invalid multipart data.": "The body is no form with the boundary that its Content-Type names; clients such as "
    "curl -F set it themselves.",
    "There was an error parsing the body": "The body cannot be read: it is no text in UTF-8, or not what its "
    "Content-Type and Content-Encoding say.",
}
"""What FastAPI and Starlette say of bodies that they cannot parse, and what that means."""


def problem_answers(*kinds: ProblemKind) -> dict[int | str, dict[str, Any]]:
    """The ``responses`` of an endpoint that may end in these kinds of problems, besides those of every request."""
    answers: dict[int | str, dict[str, Any]] = {}
    for kind in (*kinds, *_EVERYWHERE):
        answer = answers.setdefault(
            kind.status,
            {
                "description": "",
                "content": {"application/problem+json": {"schema": _PROBLEM_REFERENCE, "examples": {}}},
            },
        )
        answer["description"] = f"{answer['description']} {kind.title} (`{kind.uri}`).".lstrip()
        example = kind.document(kind.title + ".").model_dump(exclude_defaults=True)
        answer["content"][MEDIA_TYPE]["examples"][kind.uri] = {"value": example}
    return answers


def add_problem_handlers(app: FastAPI) -> None:
    """Make every error of ``app`` a problem document."""
    app.add_exception_handler(StarletteHTTPException, _http_error)
    app.add_exception_handler(RequestValidationError, _validation_error)
    for kind in (StorageUnavailable, OSError):
        app.add_exception_handler(kind, _storage_error)
    for failure in (WorkerDied, DeadlineExceeded, MemoryError):
        app.add_exception_handler(failure, _worker_error)
    for refusal in _REFUSALS:
        app.add_exception_handler(refusal, _refusal)
    app.add_exception_handler(sa.exc.DataError, _data_error)
    app.add_exception_handler(zlib.error, _encoding_error)
    app.add_exception_handler(Exception, _unforeseen_error)


def problem_response(problem: Problem, headers: dict[str, str] | None = None) -> Response:
    """A problem document as an answer."""
    content = problem.model_dump_json(exclude_defaults=True)
    retry = {"Retry-After": "1"} if problem.status == 503 else {}
    return Response(content, problem.status, retry | (headers or {}), media_type=MEDIA_TYPE)


async def _http_error(request: Request, error: Exception) -> Response:
    if isinstance(error, ProblemError):
        return problem_response(error.problem, dict(error.headers or {}))
    assert isinstance(error, StarletteHTTPException)  # what this handler is registered for
    if error.status_code == 404:
        problem = ProblemKind.NOT_FOUND.document(f"There is nothing at {request.url.path}.")
    elif error.status_code == 405:
        allowed = ", ".join(_allowed_methods(request))
        error.headers = {**(error.headers or {}), "Allow": allowed}
        detail = f"{request.url.path} does not take {request.method}; it takes {allowed}."
        problem = ProblemKind.METHOD_NOT_ALLOWED.document(detail)
    else:
        detail = _UNREADABLE.get(str(error.detail), str(error.detail))
        problem = ProblemKind.BAD_REQUEST.document(detail).model_copy(update={"status": error.status_code})
    return problem_response(problem, dict(error.headers or {}))


async def _validation_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)  # what this handler is registered for
    faults = error.errors()[:20]
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if any(one["loc"] == ("body",) for one in faults) and not _is_json(media_type):
        detail = f"The body's Content-Type is {media_type or 'missing'}; send JSON with Content-Type: application/json."
        return await _http_error(request, ProblemError(ProblemKind.MEDIA_TYPE, detail))
    fields = [InvalidField(field=pointer(one), detail=describe_fault(one, request.scope)) for one in faults]
    detail = f"{fields[0].field or 'body'}: {fields[0].detail}" if len(fields) == 1 else "Some fields are not valid."
    return problem_response(ProblemKind.INVALID_REQUEST.document(detail, errors=fields))


def _is_json(media_type: str) -> bool:
    return media_type == "application/json" or media_type.endswith("+json")


def _allowed_methods(request: Request) -> list[str]:
    """The methods that an address takes, of all routes that it matches."""
    found = set[str]()
    waiting = list(request.app.routes)
    while waiting:
        route = waiting.pop()
        if isinstance(route, Route) and route.path_regex.match(request.url.path):
            found |= route.methods or set()
        waiting += getattr(getattr(route, "original_router", None), "routes", [])  # of a router that was included
    return sorted(found | ({"HEAD"} if "GET" in found else set()))


def _describe_refusal(error: Exception) -> ProblemError:
    """What a service behind the endpoints refused, as a problem."""
    match error:
        case errors.InvalidField():
            members: dict[str, Any] = {} if error.valid is None else {"valid": list(error.valid)}
            members |= {} if error.code is None else {"code": error.code}
            return ProblemError(ProblemKind.INVALID_REQUEST, error.detail, field=error.field, **members)
        case errors.InvalidFile():
            kind = ProblemKind.INVALID_MESH if error.mesh else ProblemKind.INVALID_REQUEST
            kind = ProblemKind.UNKNOWN_FORMAT if error.code == "unknown_format" else kind
            members = {} if error.code is None else {"code": error.code}
            return ProblemError(kind, error.detail, field="/file", **members)
        case QueueFull():
            waiting, limit = error.args
            detail = f"{waiting} of your jobs are waiting, and at most {limit} may; try again later."
            return ProblemError(ProblemKind.QUEUE_FULL, detail, retry_after=5, limit=limit)
        case LimitReached():
            after = None if error.until is None else max(1, math.ceil(error.until - time.time()))
            return ProblemError(ProblemKind.LIMIT_REACHED, str(error), retry_after=after, limit=int(error.limit))
        case IdempotencyConflict():
            detail = f"This Idempotency-Key belongs to job {error.args[0]}, which asked for something else."
            return ProblemError(ProblemKind.KEY_REUSED, detail, field="Idempotency-Key")
    return ProblemError(_REFUSALS[type(error)], str(error))


_REFUSALS = {
    errors.InvalidField: ProblemKind.INVALID_REQUEST,
    errors.InvalidFile: ProblemKind.INVALID_MESH,
    errors.NotFound: ProblemKind.NOT_FOUND,
    errors.NotFinished: ProblemKind.NOT_FINISHED,
    errors.ObjectInUse: ProblemKind.IN_USE,
    errors.ResourceGone: ProblemKind.GONE,
    errors.WorkersNotReady: ProblemKind.NOT_READY,
    DiskFull: ProblemKind.STORAGE,
    TooManyWaiting: ProblemKind.TOO_MANY_WAITING,
    QueueFull: ProblemKind.QUEUE_FULL,
    LimitReached: ProblemKind.LIMIT_REACHED,
    IdempotencyConflict: ProblemKind.KEY_REUSED,
}
"""What the services behind the endpoints refuse with, and the kind of problem that it is over HTTP."""


async def _refusal(request: Request, error: Exception) -> Response:
    return await _http_error(request, _describe_refusal(error))


async def _encoding_error(request: Request, _error: Exception) -> Response:
    detail = "The body was announced as gzip, and is none or cut off."
    return await _http_error(request, ProblemError(ProblemKind.BAD_REQUEST, detail))


async def _data_error(request: Request, _error: Exception) -> Response:
    detail = "A text of the request has characters that cannot be stored, such as NUL."
    return await _http_error(request, ProblemError(ProblemKind.INVALID_REQUEST, detail))


async def _storage_error(request: Request, error: Exception) -> Response:
    _log.error("%s %s could not be stored: %s", request.method, request.url.path, error)
    return await _http_error(request, ProblemError(ProblemKind.STORAGE, "Nothing was changed; try again."))


async def _worker_error(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed in its worker: %r", request.method, request.url.path, error)
    detail = "The worker died, or needed too much time or memory."
    return await _http_error(request, ProblemError(ProblemKind.WORKER_FAILED, detail))


async def _unforeseen_error(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return problem_response(
        ProblemKind.INTERNAL.document("The service failed with an internal error; its log says more.")
    )
