"""Errors as problem documents (RFC 9457): one stable type for each kind, and how exceptions become them."""

import logging
from collections.abc import Sequence
from enum import Enum
from typing import Any

from fastapi import FastAPI, HTTPException, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from starlette.exceptions import HTTPException as StarletteHTTPException

from fingersplit_client.schemas import InvalidField, Problem
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.jobs.slot import DeadlineExceeded, WorkerDied

__all__ = ["MEDIA_TYPE", "ProblemError", "ProblemKind", "add_problem_handlers", "problem_response"]

MEDIA_TYPE = "application/problem+json"
_log = logging.getLogger(__name__)


class ProblemKind(Enum):
    """Kinds of problems: the last part of the type's URI, the HTTP status and the title."""

    BAD_REQUEST = ("bad-request", 400, "The request cannot be read")
    UNAUTHENTICATED = ("unauthenticated", 401, "Who asks is not known")
    FORBIDDEN = ("forbidden", 403, "Who asks may not do that")
    NOT_FOUND = ("not-found", 404, "No such thing")
    METHOD_NOT_ALLOWED = ("method-not-allowed", 405, "This address does not take that method")
    TOO_SLOW = ("too-slow", 408, "The request came in too slowly")
    NOT_FINISHED = ("not-finished", 409, "The job has not ended yet")
    IN_USE = ("in-use", 409, "Something else still needs it")
    GONE = ("gone", 409, "What it needs was deleted")
    TOO_LARGE = ("too-large", 413, "The request is too large")
    UNKNOWN_FORMAT = ("unknown-format", 415, "Not a file format that can be read")
    INVALID_REQUEST = ("invalid-request", 422, "The request is not valid")
    INVALID_MESH = ("invalid-mesh", 422, "The file is not a graspable object")
    KEY_REUSED = ("idempotency-key-reused", 422, "The idempotency key belongs to another request")
    QUEUE_FULL = ("queue-full", 429, "Too many jobs are waiting")
    INTERNAL = ("internal-error", 500, "The service has a fault")
    NOT_READY = ("not-ready", 503, "The workers are not warm yet")
    STORAGE = ("storage-unavailable", 503, "The service cannot write its data now")
    WORKER_FAILED = ("worker-failed", 503, "No worker could do it")

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
        if retry_after is not None or kind.status == 503:
            headers["Retry-After"] = str(retry_after or 1)
        super().__init__(kind.status, detail, headers)


def add_problem_handlers(app: FastAPI) -> None:
    """Make every error of ``app`` a problem document."""
    app.add_exception_handler(StarletteHTTPException, _http_error)
    app.add_exception_handler(RequestValidationError, _validation_error)
    for kind in (StorageUnavailable, OSError):
        app.add_exception_handler(kind, _storage_error)
    for failure in (WorkerDied, DeadlineExceeded, MemoryError):
        app.add_exception_handler(failure, _worker_error)
    app.add_exception_handler(Exception, _unforeseen_error)


def problem_response(problem: Problem, headers: dict[str, str] | None = None) -> Response:
    """A problem document as an answer."""
    content = problem.model_dump_json(exclude_defaults=True)
    return Response(content, problem.status, headers, media_type=MEDIA_TYPE)


async def _http_error(request: Request, error: Exception) -> Response:
    if isinstance(error, ProblemError):
        return problem_response(error.problem, dict(error.headers or {}))
    assert isinstance(error, StarletteHTTPException)  # what this handler is registered for
    if error.status_code == 404:
        problem = ProblemKind.NOT_FOUND.document(f"There is nothing at {request.url.path}.")
    elif error.status_code == 405:
        allowed = (error.headers or {}).get("Allow", "another method")
        detail = f"{request.url.path} does not take {request.method}; it takes {allowed}."
        problem = ProblemKind.METHOD_NOT_ALLOWED.document(detail)
    else:
        problem = ProblemKind.BAD_REQUEST.document(str(error.detail)).model_copy(update={"status": error.status_code})
    return problem_response(problem, dict(error.headers or {}))


async def _validation_error(_request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)  # what this handler is registered for
    fields = [InvalidField(field=_pointer(one["loc"]), detail=one["msg"]) for one in error.errors()[:20]]
    return problem_response(ProblemKind.INVALID_REQUEST.document("Some fields are not valid.", errors=fields))


async def _storage_error(request: Request, error: Exception) -> Response:
    _log.error("%s %s could not be stored: %s", request.method, request.url.path, error)
    return await _http_error(request, ProblemError(ProblemKind.STORAGE, "Nothing was changed; try again."))


async def _worker_error(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed in its worker: %r", request.method, request.url.path, error)
    detail = "The worker died, or needed too much time or memory."
    return await _http_error(request, ProblemError(ProblemKind.WORKER_FAILED, detail))


async def _unforeseen_error(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return problem_response(ProblemKind.INTERNAL.document("The request met a fault of the service; its log says more."))


def _pointer(location: Sequence[str | int]) -> str:
    """``("body", "planner", "gain")`` as ``/planner/gain``; a parameter by its name."""
    source, *path = location
    return "".join(f"/{part}" for part in path) if source == "body" else str(path[-1] if path else source)
