"""Batches: many jobs in one request."""

from collections import Counter
from typing import Annotated

from fastapi import APIRouter, Path, Response

from fingersplit_client.schemas import Batch, BatchCreate, BatchPage, JobState
from fingersplit_service.dependencies import Jobs, ParallelGrasps
from fingersplit_service.endpoints.documents import ID_PATTERN, Cursor, Limit, next_cursor, place
from fingersplit_service.endpoints.job_requests import IdempotencyKey, refuse_untouching
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/batches"
BatchId = Annotated[str, Path(description="Id of a batch.", max_length=64, pattern=ID_PATTERN)]
router = APIRouter(tags=["batches"])


@router.post(
    PATH,
    status_code=202,
    summary="Queue many jobs",
    responses=problem_answers(
        ProblemKind.INVALID_REQUEST,
        ProblemKind.KEY_REUSED,
        ProblemKind.QUEUE_FULL,
        ProblemKind.LIMIT_REACHED,
        ProblemKind.NOT_READY,
    ),
)
async def create_batch(
    jobs: Jobs,
    parallel_grasps: ParallelGrasps,
    principal: Planner,
    asked: BatchCreate,
    response: Response,
    idempotency_key: IdempotencyKey = None,
) -> Batch:
    """Ask for many plans. All jobs are accepted, or none is; the answer comes once they are on disk."""
    for index, job in enumerate(asked.jobs):
        await refuse_untouching(parallel_grasps, principal, job, f"/jobs/{index}")
    batch_id, rows, fresh = await jobs.submit_batch(principal.owner, asked.jobs, idempotency_key=idempotency_key)
    response.headers["Location"] = f"{PATH}/{batch_id}"
    if not fresh:
        response.headers["Idempotent-Replayed"] = "true"
    states = Counter(row.state for row in rows)
    return Batch(id=batch_id, states=dict(states), job_ids=[row.id for row in rows])


@router.get(PATH, summary="List batches", responses=problem_answers(ProblemKind.INVALID_REQUEST))
async def list_batches(jobs: Jobs, principal: Reader, limit: Limit = 100, cursor: Cursor = None) -> BatchPage:
    """Batches and how their jobs stand together, newest first."""
    found = await jobs.batches(principal.owner, place(cursor), limit)
    items = [Batch(id=batch_id, states=states, job_ids=[]) for _, batch_id, states in found]
    return BatchPage(items=items, next_cursor=next_cursor([number for number, _, _ in found], limit))


@router.post(
    PATH + "/{batch_id}/cancel",
    summary="Cancel a batch",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def cancel_batch(jobs: Jobs, principal: Planner, batch_id: BatchId) -> Batch:
    """End every job of a batch that has not ended, at once."""
    return _document(batch_id, await jobs.cancel_batch(principal.owner, batch_id))


@router.get(
    PATH + "/{batch_id}",
    summary="Get a batch",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def get_batch(jobs: Jobs, principal: Reader, batch_id: BatchId) -> Batch:
    """How the jobs of a batch stand together."""
    return _document(batch_id, await jobs.batch(principal.owner, batch_id))


def _document(batch_id: str, found: list[tuple[str, JobState]]) -> Batch:
    states = Counter(state for _, state in found)
    return Batch(id=batch_id, states=dict(states), job_ids=[job_id for job_id, _ in found])
