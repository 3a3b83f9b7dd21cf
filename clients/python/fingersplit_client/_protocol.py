"""The client without I/O: each operation is a flow that yields what to send and is given back the responses.

Both clients drive the same flows, one with blocking calls, one with awaited ones.
"""

import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict, TypeVar
from urllib.parse import quote

import httpx2
from pydantic import BaseModel, TypeAdapter, ValidationError

from fingersplit_client.errors import ApiError, FingersplitClientError, JobFailed, WaitTimeout
from fingersplit_client.schemas import (
    HandInfo,
    Job,
    JobCreate,
    ObjectInfo,
    ParallelGrasp,
    PlanResult,
    Problem,
)

__all__ = [
    "Call",
    "Flow",
    "Pause",
    "PlanOptions",
    "Progress",
    "create_job",
    "get_job",
    "hands",
    "picture",
    "plan",
    "ready",
    "upload_object",
    "wait",
]

Result = TypeVar("Result")
Model = TypeVar("Model", bound=BaseModel)
Progress = Callable[[Job], None]
"""Called with the job each time it is looked at while waiting."""

_FIRST_PAUSE, _LONGEST_PAUSE = 0.01, 0.25  # [s]
_HANDS = TypeAdapter(list[HandInfo])


class PlanOptions(TypedDict, total=False):
    """What a plan can ask for, as in `JobCreate`, which has the defaults."""

    hand: str
    parallel_grasps: list[ParallelGrasp] | None
    starts: int
    seed: int
    top_k: int
    planner: dict[str, bool | int | float]


@dataclass(frozen=True)
class Call:
    """A request to send; the flow goes on with its response."""

    method: str
    path: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pause:
    """A time to let pass [s]."""

    seconds: float


Flow = Generator[Call | Pause, httpx2.Response | None, Result]
"""What an operation does: it yields calls and pauses, takes responses and returns its result."""


def upload_object(mesh: Path | str | bytes, unit: str, name: str | None, file_type: str | None) -> Flow[ObjectInfo]:
    """Upload a mesh file, or its bytes and their type."""
    if isinstance(mesh, bytes):
        if file_type is None:
            raise FingersplitClientError("Bytes do not say what they are: give file_type, such as 'stl' or 'ply'.")
        stem, suffix, content = "object", f".{file_type.lstrip('.')}", mesh
    else:
        path = Path(mesh)
        stem, suffix, content = (
            path.stem,
            f".{file_type.lstrip('.')}" if file_type else path.suffix,
            path.read_bytes(),
        )
    arguments = {
        "data": {"unit": unit, "name": name or stem},
        "files": {"file": (stem + suffix, content, "application/octet-stream")},
    }
    response = yield from _exchange("POST", "/v1/objects", **arguments)
    return _parse(ObjectInfo, response)


def create_job(request: JobCreate) -> Flow[Job]:
    """Queue a job."""
    response = yield from _exchange("POST", "/v1/jobs", json=request.model_dump(mode="json"))
    return _parse(Job, response)


def get_job(job_id: str) -> Flow[Job]:
    """Where a job stands."""
    response = yield from _exchange("GET", f"/v1/jobs/{quote(job_id, safe='')}")
    return _parse(Job, response)


def wait(job: Job, timeout: float, on_progress: Progress | None) -> Flow[Job]:
    """Look at a job until it has ended, at growing distances in time."""
    deadline, pause = time.monotonic() + timeout, _FIRST_PAUSE
    while True:
        if on_progress is not None:
            on_progress(job)
        if job.state == "succeeded":
            return job
        if job.state in ("failed", "cancelled"):
            raise JobFailed(job)
        left = deadline - time.monotonic()
        if left <= 0:
            raise WaitTimeout(job, timeout)
        yield Pause(min(pause, left))
        pause = min(1.5 * pause, _LONGEST_PAUSE)
        job = yield from get_job(job.id)


def plan(
    mesh: Path | str | bytes,
    unit: str,
    name: str | None,
    file_type: str | None,
    timeout: float,
    on_progress: Progress | None,
    options: PlanOptions,
) -> Flow[PlanResult]:
    """Upload, queue, wait."""
    uploaded = yield from upload_object(mesh, unit, name, file_type)
    job = yield from create_job(JobCreate(object_id=uploaded.id, **options))
    job = yield from wait(job, timeout, on_progress)
    if job.result is None:
        raise FingersplitClientError(f"Job {job.id} has succeeded and carries no result.")
    return job.result


def ready() -> Flow[bool]:
    """Whether the service's workers are warm."""
    response = yield Call("GET", "/readyz")
    assert response is not None  # a call is always answered
    return response.is_success


def hands() -> Flow[list[HandInfo]]:
    """The hands that can be planned for."""
    response = yield from _exchange("GET", "/v1/hands")
    return _HANDS.validate_json(response.content)


def picture(job_id: str, rank: int) -> Flow[bytes]:
    """The picture of one grasp, PNG."""
    response = yield from _exchange("GET", f"/v1/jobs/{quote(job_id, safe='')}/grasps/{rank}/picture.png")
    return response.content


def _exchange(method: str, path: str, **arguments: Any) -> Flow[httpx2.Response]:
    response = yield Call(method, path, arguments)
    assert response is not None  # a call is always answered; only pauses are not
    if response.is_success:
        return response
    raise ApiError(_problem(response))


def _problem(response: httpx2.Response) -> Problem:
    try:
        return Problem.model_validate_json(response.content)
    except ValidationError:  # something between us and the service answered
        text = f"{response.url} answered {response.status_code}, without a problem document."
        return Problem(type="about:blank", title="Unexpected answer", status=response.status_code, detail=text)


def _parse(model: type[Model], response: httpx2.Response) -> Model:
    try:
        return model.model_validate_json(response.content)
    except ValidationError as error:
        text = f"{response.url} answered with an unexpected document; client and service may differ in version."
        raise FingersplitClientError(text) from error
