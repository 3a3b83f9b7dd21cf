"""The client without I/O: an operation is a flow that yields what to send and is given back the responses.

Both clients drive the same flows, one with blocking calls, one with awaited ones.
"""

import json
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar
from urllib.parse import quote

import httpx2
from pydantic import BaseModel, TypeAdapter, ValidationError

from fingersplit_client.errors import ApiError, FingersplitClientError
from fingersplit_client.schemas import JobSummary, Problem

__all__ = [
    "Call",
    "EventReader",
    "Flow",
    "JobEvent",
    "default_headers",
    "dump",
    "exchange",
    "given",
    "parse",
    "parse_list",
    "problem",
    "quoted",
]

Result = TypeVar("Result")
Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True)
class Call:
    """A request to send; the flow goes on with its response."""

    method: str
    path: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


Flow = Generator[Call, httpx2.Response, Result]
"""What an operation does: it yields calls, takes responses and returns its result."""


@dataclass(frozen=True)
class JobEvent:
    """A change of a job.

    Attributes:
        id: Its place in the stream; give it as ``last_event_id`` to go on after it.
        job: The job as it was then.
    """

    id: str
    job: JobSummary


class EventReader:
    """Makes events from the lines of a stream of server-sent events."""

    def __init__(self) -> None:
        self._fields: dict[str, str] = {}

    def read(self, line: str) -> JobEvent | None:
        """Take one line; the event that it ends, if it ends one."""
        if line:
            name, _, value = line.partition(":")
            self._fields[name] = value.removeprefix(" ")
            return None
        fields, self._fields = self._fields, {}
        if "data" not in fields:
            return None
        return JobEvent(fields.get("id", ""), JobSummary.model_validate(json.loads(fields["data"])))


def default_headers(api_key: str | None) -> dict[str, str]:
    """Headers of every request."""
    return {"Authorization": f"Bearer {api_key}"} if api_key else {}


def exchange(method: str, path: str, **arguments: Any) -> Flow[httpx2.Response]:
    """Send one request; its response, unless it is a refusal.

    Raises:
        ApiError: The service refused.
    """
    response = yield Call(method, path, arguments)
    if response.is_success:
        return response
    raise ApiError(problem(response))


def problem(response: httpx2.Response) -> Problem:
    """The problem document of a refusal, also where something between us and the service refused."""
    try:
        return Problem.model_validate_json(response.content)
    except ValidationError:  # something between us and the service answered
        text = f"{response.url} answered {response.status_code}, without a problem document."
        return Problem(type="about:blank", title="Unexpected answer", status=response.status_code, detail=text)


def parse(model: type[Model], response: httpx2.Response) -> Model:
    """The document in a response."""
    return _parsed(model.model_validate_json, response)


def parse_list(adapter: TypeAdapter[list[Model]], response: httpx2.Response) -> list[Model]:
    """The list of documents in a response."""
    return _parsed(adapter.validate_json, response)


def _parsed(validate: Callable[[bytes], Result], response: httpx2.Response) -> Result:
    try:
        return validate(response.content)
    except ValidationError as error:
        text = f"{response.url} answered with an unexpected document; client and service may differ in version."
        raise FingersplitClientError(text) from error


def dump(model: BaseModel) -> Any:
    """A document as it is sent, without what is as by default."""
    return model.model_dump(mode="json", exclude_defaults=True)


def given(**parameters: Any) -> dict[str, Any]:
    """The parameters that are not None."""
    return {name: value for name, value in parameters.items() if value is not None}


def quoted(part: str) -> str:
    """A part of a path, whatever stands in it."""
    return quote(part, safe="")
