"""Jobs: queue one, see how it stands or wait for its end, list, cancel, delete."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, Response

from fingersplit_client.schemas import Job, JobCreate, JobPage, JobState
from fingersplit_service.database.jobs import JobFilter
from fingersplit_service.dependencies import Jobs, ParallelGrasps, Settings
from fingersplit_service.endpoints.documents import (
    Cursor,
    JobId,
    Limit,
    job_document,
    json_response,
    next_cursor,
    place,
    summarize,
)
from fingersplit_service.endpoints.job_requests import (
    IdempotencyKey,
    Prefer,
    preference_applied,
    refuse_untouching,
    wait_seconds,
)
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

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
        ProblemKind.INVALID_REQUEST,
        ProblemKind.KEY_REUSED,
        ProblemKind.QUEUE_FULL,
        ProblemKind.LIMIT_REACHED,
        ProblemKind.NOT_READY,
    ),
)
async def create_job(
    jobs: Jobs,
    parallel_grasps: ParallelGrasps,
    settings: Settings,
    principal: Planner,
    asked: Annotated[JobCreate, Body(openapi_examples=_EXAMPLES)],
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Ask for grasps. The answer comes once the job is on disk: what was accepted is not lost.

    With `Prefer: wait=<seconds>` it comes as soon as the job has ended, with the result, or when the time is over.
    """
    seconds = wait_seconds(prefer, settings.max_wait_s)
    await refuse_untouching(parallel_grasps, principal, asked)
    job = await jobs.submit(principal.owner, asked, idempotency_key=idempotency_key, wait_s=seconds)
    headers = {"Location": f"{PATH}/{job.row.id}"} | preference_applied(seconds)
    if not job.fresh:
        headers["Idempotent-Replayed"] = "true"
    return json_response(job_document(job), 202 if job.fresh and not job.row.ended else 200, headers)


@router.get(
    PATH,
    response_model=JobPage,
    summary="List the jobs",
    responses=problem_answers(ProblemKind.INVALID_REQUEST),
)
async def list_jobs(
    jobs: Jobs,
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
    found = await jobs.page(principal.owner, which, place(cursor), limit)
    page = JobPage.model_construct(
        items=[summarize(job) for job in found],
        next_cursor=next_cursor([job.row.number for job in found], limit),
    )
    return json_response(page.model_dump_json())


@router.get(
    PATH + "/{job_id}",
    response_model=Job,
    summary="Get a job",
    responses=_NOT_ENDED | problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def get_job(jobs: Jobs, settings: Settings, principal: Reader, job_id: JobId, prefer: Prefer = None) -> Response:
    """Where a job stands, and its grasps once it has succeeded.

    With `Prefer: wait=<seconds>` the answer comes as soon as the job has ended, or when the time is over (202).
    """
    seconds = wait_seconds(prefer, settings.max_wait_s)
    job = await jobs.wait(principal.owner, job_id, seconds)
    status = 202 if seconds and not job.row.ended else 200
    return json_response(job_document(job), status, preference_applied(seconds))


@router.post(
    PATH + "/{job_id}/cancel",
    response_model=Job,
    summary="Cancel a job",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def cancel_job(jobs: Jobs, principal: Planner, job_id: JobId) -> Response:
    """End a job that has not ended; its worker's core is free at once. One that has ended stays as it is."""
    return json_response(job_document(await jobs.cancel(principal.owner, job_id)))


@router.delete(
    PATH + "/{job_id}",
    status_code=204,
    summary="Delete a job",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def delete_job(jobs: Jobs, principal: Planner, job_id: JobId) -> Response:
    """Delete a job with its result, pictures and recordings; one that has not ended is cancelled first."""
    await jobs.delete(principal.owner, job_id)
    return Response(status_code=204)
