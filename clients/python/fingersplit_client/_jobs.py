"""What can be asked about jobs and the service, each operation as a flow of `_protocol`."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypedDict
from uuid import uuid4

from pydantic import TypeAdapter

from fingersplit_client._objects import upload_object
from fingersplit_client._protocol import Call, Flow, dump, exchange, given, parse, parse_list, quoted
from fingersplit_client.errors import FingersplitClientError, JobFailed, WaitTimeout
from fingersplit_client.schemas import (
    Batch,
    BatchCreate,
    ControllerName,
    Grasp,
    HandInfo,
    Job,
    JobCreate,
    JobPage,
    JobState,
    JobVerification,
    ParallelGrasp,
    PlanResult,
    ProtocolName,
    SourceName,
)

__all__ = [
    "PlanOptions",
    "Progress",
    "cancel_job",
    "create_batch",
    "create_job",
    "delete_job",
    "events_path",
    "get_batch",
    "get_job",
    "grasps",
    "hands",
    "list_jobs",
    "picture",
    "plan",
    "ready",
    "recording",
    "verification",
    "wait",
]

Progress = Callable[[Job], None]
"""Called with the job each time it is looked at while waiting."""

_LONGEST_WAIT = 25.0  # for one answer, below what something between us and the service would cut [s]
_WAIT_WITH_PROGRESS = 0.25  # between two looks at a job whose progress somebody wants to see [s]
_HANDS = TypeAdapter(list[HandInfo])
_GRASPS = TypeAdapter(list[Grasp])


class PlanOptions(TypedDict, total=False):
    """What a plan can ask for, as in `JobCreate`, which has the defaults."""

    hand: str
    parallel_grasps: list[ParallelGrasp] | None
    parallel_grasp_set: str | None
    source: SourceName
    starts: int
    seed: int
    top_k: int
    planner: dict[str, bool | int | float | str]
    verified: int
    protocol: ProtocolName
    controller: ControllerName
    verify_initial: bool
    recording: bool
    priority: int
    deadline_s: float | None


def create_job(request: JobCreate, wait: float, idempotency_key: str | None) -> Flow[Job]:
    """Queue a job, and wait for its end at most ``wait`` seconds."""
    headers = _prefer(wait) | ({"Idempotency-Key": idempotency_key} if idempotency_key else {})
    response = yield from exchange("POST", "/v1/jobs", json=dump(request), headers=headers)
    return parse(Job, response)


def get_job(job_id: str, wait: float = 0.0) -> Flow[Job]:
    """Where a job stands, now or when it has ended."""
    response = yield from exchange("GET", _job(job_id), headers=_prefer(wait))
    return parse(Job, response)


def list_jobs(
    limit: int,
    cursor: str | None,
    state: Sequence[JobState],
    object_id: str | None,
    hand: str | None,
    batch_id: str | None,
) -> Flow[JobPage]:
    """A page of the jobs."""
    filters = given(object_id=object_id, hand=hand, batch_id=batch_id, limit=limit, cursor=cursor)
    response = yield from exchange("GET", "/v1/jobs", params=filters | {"state": list(state)})
    return parse(JobPage, response)


def cancel_job(job_id: str) -> Flow[Job]:
    """End a job."""
    response = yield from exchange("POST", f"{_job(job_id)}/cancel")
    return parse(Job, response)


def delete_job(job_id: str) -> Flow[None]:
    """Delete a job."""
    yield from exchange("DELETE", _job(job_id))


def create_batch(requests: Sequence[JobCreate]) -> Flow[Batch]:
    """Queue many jobs, all or none."""
    response = yield from exchange("POST", "/v1/batches", json=dump(BatchCreate(jobs=list(requests))))
    return parse(Batch, response)


def get_batch(batch_id: str) -> Flow[Batch]:
    """How a batch stands."""
    response = yield from exchange("GET", f"/v1/batches/{quoted(batch_id)}")
    return parse(Batch, response)


def wait(job: Job, timeout: float, on_progress: Progress | None) -> Flow[Job]:
    """Wait until a job has ended; the service answers as soon as it has."""
    deadline = time.monotonic() + timeout
    longest = _LONGEST_WAIT if on_progress is None else _WAIT_WITH_PROGRESS
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
        job = yield from get_job(job.id, min(longest, left))


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
    end = time.monotonic() + timeout
    at_once = min(_LONGEST_WAIT if on_progress is None else 0.0, timeout)
    job = yield from create_job(JobCreate(object_id=uploaded.id, **options), at_once, uuid4().hex)
    job = yield from wait(job, end - time.monotonic(), on_progress)
    if job.result is None:
        raise FingersplitClientError(f"Job {job.id} has succeeded and carries no result.")
    return job.result


def ready() -> Flow[bool]:
    """Whether the service's workers are warm."""
    response = yield Call("GET", "/readyz")
    return response.is_success


def hands() -> Flow[list[HandInfo]]:
    """The hands that can be planned for."""
    response = yield from exchange("GET", "/v1/hands")
    return parse_list(_HANDS, response)


def grasps(job_id: str) -> Flow[list[Grasp]]:
    """The grasps of a job."""
    response = yield from exchange("GET", f"{_job(job_id)}/grasps")
    return parse_list(_GRASPS, response)


def verification(job_id: str) -> Flow[JobVerification]:
    """What simulation showed of a job's grasps."""
    response = yield from exchange("GET", f"{_job(job_id)}/verification")
    return parse(JobVerification, response)


def picture(job_id: str, rank: int) -> Flow[bytes]:
    """The picture of one grasp, PNG."""
    response = yield from exchange("GET", f"{_job(job_id)}/grasps/{rank}/picture.png")
    return response.content


def recording(job_id: str, rank: int) -> Flow[bytes]:
    """The recording of one grasp, for the Rerun viewer."""
    response = yield from exchange("GET", f"{_job(job_id)}/grasps/{rank}/recording.rrd")
    return response.content


def events_path(job_id: str) -> str:
    """Where a job's events come from."""
    return f"{_job(job_id)}/events"


def _prefer(seconds: float) -> dict[str, str]:
    return {"Prefer": f"wait={seconds:g}"} if seconds > 0 else {}


def _job(job_id: str) -> str:
    return f"/v1/jobs/{quoted(job_id)}"
