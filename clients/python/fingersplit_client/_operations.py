"""What can be asked of the service, each operation as a flow of `_protocol`."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypedDict
from urllib.parse import quote
from uuid import uuid4

from pydantic import BaseModel, TypeAdapter

from fingersplit_client._protocol import Call, Flow, exchange, parse, parse_list
from fingersplit_client.errors import FingersplitClientError, JobFailed, WaitTimeout
from fingersplit_client.schemas import (
    Batch,
    BatchCreate,
    Grasp,
    HandInfo,
    Job,
    JobCreate,
    JobPage,
    JobState,
    JobVerification,
    ObjectInfo,
    ObjectPage,
    ParallelGrasp,
    ParallelGraspsCreate,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
    PlanResult,
)

__all__ = [
    "PlanOptions",
    "Progress",
    "cancel_job",
    "create_batch",
    "create_job",
    "delete_job",
    "delete_object",
    "delete_parallel_grasps",
    "events_path",
    "generate_parallel_grasps",
    "get_batch",
    "get_job",
    "get_object",
    "grasps",
    "hands",
    "import_parallel_grasps",
    "list_jobs",
    "list_objects",
    "list_parallel_grasps",
    "mesh",
    "parallel_grasps",
    "picture",
    "plan",
    "ready",
    "recording",
    "upload_object",
    "verification",
    "wait",
]

Progress = Callable[[Job], None]
"""Called with the job each time it is looked at while waiting."""

_LONGEST_WAIT = 25.0  # for one answer, below what something between us and the service would cut [s]
_WAIT_WITH_PROGRESS = 0.25  # between two looks at a job whose progress somebody wants to see [s]
_HANDS = TypeAdapter(list[HandInfo])
_GRASPS = TypeAdapter(list[Grasp])
_SETS = TypeAdapter(list[ParallelGraspSetInfo])


class PlanOptions(TypedDict, total=False):
    """What a plan can ask for, as in `JobCreate`, which has the defaults."""

    hand: str
    parallel_grasps: list[ParallelGrasp] | None
    parallel_grasp_set: str | None
    starts: int
    seed: int
    top_k: int
    planner: dict[str, bool | int | float]
    verified: int
    protocol: str
    controller: str
    verify_initial: bool
    recording: bool
    priority: int
    deadline_s: float | None


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
    response = yield from exchange("POST", "/v1/objects", **arguments)
    return parse(ObjectInfo, response)


def get_object(object_id: str) -> Flow[ObjectInfo]:
    """One object."""
    response = yield from exchange("GET", _object(object_id))
    return parse(ObjectInfo, response)


def list_objects(limit: int, cursor: str | None) -> Flow[ObjectPage]:
    """A page of the objects."""
    response = yield from exchange("GET", "/v1/objects", params=_given(limit=limit, cursor=cursor))
    return parse(ObjectPage, response)


def delete_object(object_id: str) -> Flow[None]:
    """Delete an object."""
    yield from exchange("DELETE", _object(object_id))


def mesh(object_id: str, file_type: str) -> Flow[bytes]:
    """The checked mesh as a file."""
    response = yield from exchange("GET", f"{_object(object_id)}/mesh", params={"format": file_type})
    return response.content


def generate_parallel_grasps(object_id: str, request: ParallelGraspsGenerate) -> Flow[ParallelGraspSet]:
    """Have parallel grasps found."""
    response = yield from exchange("POST", f"{_object(object_id)}/parallel-grasps/generate", json=_dump(request))
    return parse(ParallelGraspSet, response)


def import_parallel_grasps(object_id: str, grasps: Sequence[ParallelGrasp], name: str) -> Flow[ParallelGraspSet]:
    """Store parallel grasps."""
    request = ParallelGraspsCreate(parallel_grasps=list(grasps), name=name)
    response = yield from exchange("POST", f"{_object(object_id)}/parallel-grasps", json=_dump(request))
    return parse(ParallelGraspSet, response)


def list_parallel_grasps(object_id: str) -> Flow[list[ParallelGraspSetInfo]]:
    """The sets of an object."""
    response = yield from exchange("GET", f"{_object(object_id)}/parallel-grasps")
    return parse_list(_SETS, response)


def parallel_grasps(object_id: str, set_id: str) -> Flow[ParallelGraspSet]:
    """One set."""
    response = yield from exchange("GET", f"{_object(object_id)}/parallel-grasps/{_quoted(set_id)}")
    return parse(ParallelGraspSet, response)


def delete_parallel_grasps(object_id: str, set_id: str) -> Flow[None]:
    """Delete a set."""
    yield from exchange("DELETE", f"{_object(object_id)}/parallel-grasps/{_quoted(set_id)}")


def create_job(request: JobCreate, wait: float, idempotency_key: str | None) -> Flow[Job]:
    """Queue a job, and wait for its end at most ``wait`` seconds."""
    headers = _prefer(wait) | ({"Idempotency-Key": idempotency_key} if idempotency_key else {})
    response = yield from exchange("POST", "/v1/jobs", json=_dump(request), headers=headers)
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
    filters = _given(object_id=object_id, hand=hand, batch_id=batch_id, limit=limit, cursor=cursor)
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
    response = yield from exchange("POST", "/v1/batches", json=_dump(BatchCreate(jobs=list(requests))))
    return parse(Batch, response)


def get_batch(batch_id: str) -> Flow[Batch]:
    """How a batch stands."""
    response = yield from exchange("GET", f"/v1/batches/{_quoted(batch_id)}")
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


def _dump(model: BaseModel) -> Any:
    return model.model_dump(mode="json", exclude_defaults=True)


def _prefer(seconds: float) -> dict[str, str]:
    return {"Prefer": f"wait={seconds:g}"} if seconds > 0 else {}


def _given(**parameters: Any) -> dict[str, Any]:
    return {name: value for name, value in parameters.items() if value is not None}


def _quoted(part: str) -> str:
    return quote(part, safe="")


def _object(object_id: str) -> str:
    return f"/v1/objects/{_quoted(object_id)}"


def _job(job_id: str) -> str:
    return f"/v1/jobs/{_quoted(job_id)}"
