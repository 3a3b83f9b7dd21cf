"""Jobs: queue one, see how it stands or wait for its end, list, cancel, delete."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, Response

from fingersplit_client.schemas import Job, JobCreate, JobPage, JobState
from fingersplit_service.database.jobs import JobFilter
from fingersplit_service.database.rows import JobRow
from fingersplit_service.endpoints.documents import (
    Cursor,
    JobId,
    Limit,
    job_document,
    json_response,
    known_job,
    next_cursor,
    place,
    summarize,
)
from fingersplit_service.endpoints.orders import IdempotencyKey, Prefer, accept, order, wait_seconds
from fingersplit_service.jobs.watch import Change
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency
from fingersplit_service.security.access import Planner, Principal, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/jobs"
router = APIRouter(tags=["jobs"])

_EXAMPLES: Any = {
    "find": {
        "summary": "Have parallel grasps found",
        "value": {
            "object_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
            "hand": "barrett",
            "starts": 64,
            "seed": 1,
        },
    },
    "given": {
        "summary": "Start from a given parallel grasp, with a tighter pad angle",
        "value": {
            "object_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
            "parallel_grasps": [{"contacts": [[0.03, 0.0, 0.05], [-0.03, 0.0, 0.05]], "approach": [0.0, 0.0, -1.0]}],
            "planner": {"pad_angle_limit": 0.5},
        },
    },
    "verified": {
        "summary": "Simulate the ranked grasps until one has held",
        "value": {"object_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0", "starts": 64, "verified": 1, "protocol": "lift"},
    },
}
_ENDED: dict[int | str, dict[str, Any]] = {200: {"model": Job, "description": "The job has ended."}}
_NOT_ENDED: dict[int | str, dict[str, Any]] = {
    202: {"model": Job, "description": "The time to wait is over, and the job has not ended."}
}


@router.post(
    PATH,
    status_code=202,
    response_model=Job,
    summary="Queue a job",
    responses=_ENDED
    | problem_answers(
        ProblemKind.INVALID_REQUEST, ProblemKind.KEY_REUSED, ProblemKind.QUEUE_FULL, ProblemKind.NOT_READY
    ),
)
async def create_job(
    runtime: RuntimeDependency,
    principal: Planner,
    asked: Annotated[JobCreate, Body(openapi_examples=_EXAMPLES)],
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Ask for grasps. The answer comes once the job is on disk: what was accepted is not lost.

    With `Prefer: wait=<seconds>` it comes as soon as the job has ended, with the result, or when the time is over.
    """
    new = await order(runtime, principal, asked)
    seconds = wait_seconds(runtime, prefer)
    with runtime.watch.watcher(new.id) as watcher:
        (row,), fresh = await accept(runtime, principal, [new], idempotency_key=idempotency_key)
        headers = {"Location": f"{PATH}/{row.id}"}
        if not fresh:
            headers["Idempotent-Replayed"] = "true"
        elif seconds and (end := await watcher.end(seconds)):
            return await _answer(runtime, principal, row.id, seconds, headers, end)
    if fresh:
        return json_response(job_document(runtime, row, None), 202, headers | _applied(seconds))
    return await _wait(runtime, principal, row.id, seconds, headers)


@router.get(
    PATH,
    response_model=JobPage,
    summary="List the jobs",
    responses=problem_answers(ProblemKind.INVALID_REQUEST),
)
async def list_jobs(
    runtime: RuntimeDependency,
    principal: Reader,
    state: Annotated[list[JobState] | None, Query(description="Only jobs in one of these states.")] = None,
    object_id: Annotated[str | None, Query(description="Only jobs of this object.", max_length=64)] = None,
    hand: Annotated[str | None, Query(description="Only jobs for this hand.", max_length=64)] = None,
    batch_id: Annotated[str | None, Query(description="Only jobs of this batch.", max_length=64)] = None,
    object_name: Annotated[
        str | None, Query(description="Only jobs whose object's name has this in it.", max_length=200)
    ] = None,
    limit: Limit = 100,
    cursor: Cursor = None,
) -> Response:
    """Jobs without requests and results, newest first."""
    which = JobFilter(tuple(state or ()), object_id, hand, batch_id, object_name)
    rows = await runtime.jobs.page(principal.owner, which, place(cursor), limit)
    page = JobPage.model_construct(
        items=[summarize(runtime, row) for row in rows],
        next_cursor=next_cursor([row.number for row in rows], limit),
    )
    return json_response(page.model_dump_json())


@router.get(
    PATH + "/{job_id}",
    response_model=Job,
    summary="Get a job",
    responses=_NOT_ENDED | problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def get_job(runtime: RuntimeDependency, principal: Reader, job_id: JobId, prefer: Prefer = None) -> Response:
    """Where a job stands, and its grasps once it has succeeded.

    With `Prefer: wait=<seconds>` the answer comes as soon as the job has ended, or when the time is over (202).
    """
    return await _wait(runtime, principal, job_id, wait_seconds(runtime, prefer), {})


@router.post(
    PATH + "/{job_id}/cancel",
    response_model=Job,
    summary="Cancel a job",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def cancel_job(runtime: RuntimeDependency, principal: Planner, job_id: JobId) -> Response:
    """End a job that has not ended; its worker's core is free at once. One that has ended stays as it is."""
    before, _ = await known_job(runtime, principal, job_id)
    if not before.ended:
        await _cancel(runtime, principal, job_id)
    row, result = await known_job(runtime, principal, job_id)
    return json_response(job_document(runtime, row, result))


@router.delete(
    PATH + "/{job_id}",
    status_code=204,
    summary="Delete a job",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def delete_job(runtime: RuntimeDependency, principal: Planner, job_id: JobId) -> Response:
    """Delete a job with its result, pictures and recordings; one that has not ended is cancelled first."""
    row, _ = await known_job(runtime, principal, job_id)
    if not row.ended:
        await _cancel(runtime, principal, job_id)
    await runtime.jobs.delete(principal.owner, job_id)
    await runtime.remove_job_files(job_id)
    return Response(status_code=204)


async def _cancel(runtime: Runtime, principal: Principal, job_id: str) -> JobRow | None:
    row = await runtime.jobs.cancel(principal.owner, job_id)
    if row is not None and row.state == "cancelled":
        runtime.watch.tell(job_id, "cancelled")
        runtime.dispatcher.interrupt(job_id)
        runtime.metrics.ended.labels("cancelled").inc()
    return row


async def _wait(
    runtime: Runtime, principal: Principal, job_id: str, seconds: float, headers: dict[str, str]
) -> Response:
    """The job at once, or when it has ended, or when the time is over."""
    with runtime.watch.watcher(job_id) as watcher:
        row, result = await known_job(runtime, principal, job_id)
        if row.ended or not seconds:
            return json_response(job_document(runtime, row, result), headers=headers | _applied(seconds))
        end = await watcher.end(seconds)
    return await _answer(runtime, principal, job_id, seconds, headers, end)


async def _answer(
    runtime: Runtime, principal: Principal, job_id: str, seconds: float, headers: dict[str, str], end: Change | None
) -> Response:
    """The job as it ended, or as it is now."""
    row, result = (end and end.outcome) or await known_job(runtime, principal, job_id)
    status = 200 if row.ended else 202
    return json_response(job_document(runtime, row, result), status, headers | _applied(seconds))


def _applied(seconds: float) -> dict[str, str]:
    return {"Preference-Applied": f"wait={seconds:g}"} if seconds else {}
