"""Requests as flows: sent, repeated where that is safe, and their answers read."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar
from urllib.parse import quote
from uuid import uuid4

import httpx2
from pydantic import BaseModel, TypeAdapter, ValidationError

from fingersplit_client._flow import Flow, Open, Pause, Send
from fingersplit_client.errors import (
    ApiError,
    AuthenticationError,
    ConflictError,
    FingersplitClientError,
    InvalidRequestError,
    NotFoundError,
    OverloadedError,
    RequestTimeout,
    ServiceUnreachable,
    WaitTimeout,
)
from fingersplit_client.retries import Retries, retry_after
from fingersplit_client.schemas import Problem

__all__ = ["Deadline", "Policy", "dump", "exchange", "given", "parse", "parse_list", "quoted", "refusal"]

Result = TypeVar("Result")
Model = TypeVar("Model", bound=BaseModel)

_GRACE = 1.0
"""For an answer that was asked for at the deadline to arrive [s]."""
_SAFE_TO_REPEAT = {"GET", "PUT", "DELETE"}
_CAUSES: dict[int, type[ApiError]] = {
    400: InvalidRequestError,
    401: AuthenticationError,
    403: AuthenticationError,
    404: NotFoundError,
    405: InvalidRequestError,
    408: OverloadedError,
    409: ConflictError,
    413: InvalidRequestError,
    415: InvalidRequestError,
    422: InvalidRequestError,
    429: OverloadedError,
    502: OverloadedError,
    503: OverloadedError,
    504: OverloadedError,
}


@dataclass(frozen=True)
class Policy:
    """How a client sends its requests.

    Attributes:
        base_url: Where the service listens.
        timeout: How long to wait for one answer [s].
        retries: How requests are repeated.
    """

    base_url: str
    timeout: float
    retries: Retries


@dataclass(frozen=True)
class Deadline:
    """When the time for something is over.

    Attributes:
        timeout: How long it may take, from now [s].
    """

    timeout: float
    _end: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_end", time.monotonic() + self.timeout)

    @property
    def left(self) -> float:
        """What is left of the time, never negative [s]."""
        return max(self._end - time.monotonic(), 0.0)


def exchange(
    policy: Policy,
    method: str,
    path: str,
    *,
    deadline: Deadline | None = None,
    longer: float = 0.0,
    repeatable: bool | None = None,
    opened: bool = False,
    **arguments: Any,
) -> Flow[httpx2.Response]:
    """Send a request, again where it may help; its response, unless it is a refusal.

    Args:
        policy: How the client sends.
        method: The HTTP method.
        path: Path of the address.
        deadline: When the time for what the request is part of is over.
        longer: How much longer than other answers this one may take [s].
        repeatable: Whether it does no harm when it arrives twice; by default where its method says so.
        opened: Whether the answer is read line by line, by the caller.
        **arguments: See `Send`.

    Raises:
        ApiError: The service refused.
        ServiceUnreachable: No answer came.
        WaitTimeout: The deadline is over.
    """
    if repeatable is None:
        repeatable = method in _SAFE_TO_REPEAT
    request_id = uuid4().hex
    arguments["headers"] = {"X-Request-ID": request_id} | arguments.get("headers", {})
    for attempt in range(policy.retries.attempts):
        command = _command(policy, method, path, deadline, longer, opened, arguments)
        try:
            response: httpx2.Response = yield command
        except httpx2.TransportError as error:
            if deadline is not None and not deadline.left:
                raise WaitTimeout(None, deadline.timeout, request_id) from error
            pause = policy.retries.pause_after_failure(error, attempt, repeatable)
            if not _pauses(pause, deadline):
                raise _no_answer(policy.base_url, command.timeout, error, request_id) from error
        else:
            if response.is_success:
                return response
            pause = policy.retries.pause_after_answer(response, attempt)
            if not _pauses(pause, deadline):
                raise refusal(response, request_id)
        yield Pause(pause or 0.0)
    raise AssertionError("the last attempt returns or raises")


def refusal(response: httpx2.Response, request_id: str | None = None) -> ApiError:
    """The error of a refusal, also where something between us and the service refused."""
    try:
        problem = Problem.model_validate_json(response.content)
    except ValidationError:  # something between us and the service answered
        text = f"{response.url} answered {response.status_code}, without a problem document."
        problem = Problem(type="about:blank", title="Unexpected answer", status=response.status_code, detail=text)
    cause = _CAUSES.get(response.status_code, ApiError)
    return cause(problem, response.headers.get("X-Request-ID", request_id), retry_after(response))


def parse(model: type[Model], response: httpx2.Response) -> Model:
    """The document in a response."""
    return _parsed(model.model_validate_json, response)


def parse_list(adapter: TypeAdapter[list[Model]], response: httpx2.Response) -> list[Model]:
    """The list of documents in a response."""
    return _parsed(adapter.validate_json, response)


def dump(model: BaseModel) -> Any:
    """A document as it is sent, without what is as by default."""
    return model.model_dump(mode="json", exclude_defaults=True)


def given(**parameters: Any) -> dict[str, Any]:
    """The parameters that are not None."""
    return {name: value for name, value in parameters.items() if value is not None}


def quoted(part: str) -> str:
    """A part of a path, whatever stands in it."""
    return quote(part, safe="")


def _command(
    policy: Policy,
    method: str,
    path: str,
    deadline: Deadline | None,
    longer: float,
    opened: bool,
    arguments: dict[str, Any],
) -> Send:
    timeout = policy.timeout + longer
    if deadline is not None:
        timeout = min(timeout, deadline.left + _GRACE)
    return (Open if opened else Send)(method, path, arguments, timeout)


def _pauses(pause: float | None, deadline: Deadline | None) -> bool:
    """Whether there will be another attempt: one is allowed, and there is time for the pause before it."""
    return pause is not None and (deadline is None or pause < deadline.left)


def _no_answer(base_url: str, timeout: float, error: httpx2.TransportError, request_id: str) -> ServiceUnreachable:
    if isinstance(error, httpx2.TimeoutException) and not isinstance(error, httpx2.ConnectTimeout):
        return RequestTimeout(f"No answer from {base_url} within {timeout:g} s", request_id)
    reason = str(error).rstrip(".") or type(error).__name__
    return ServiceUnreachable(f"No answer from {base_url}: {reason}", request_id)


def _parsed(validate: Callable[[bytes], Result], response: httpx2.Response) -> Result:
    try:
        return validate(response.content)
    except ValidationError as error:
        text = f"{response.url} answered with an unexpected document; client and service may differ in version."
        raise FingersplitClientError(text) from error
