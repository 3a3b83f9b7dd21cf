"""Batches: many jobs in one request."""

from collections import Counter
from typing import Annotated
from uuid import uuid4

from fastapi import APIRouter, Path, Response

from fingersplit_client.schemas import Batch, BatchCreate
from fingersplit_service.endpoints.orders import accept, order
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import RuntimeDependency
from fingersplit_service.security.access import Planner, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/batches"
router = APIRouter(tags=["batches"])


@router.post(
    PATH,
    status_code=202,
    summary="Queue many jobs",
    responses=problem_answers(ProblemKind.INVALID_REQUEST, ProblemKind.QUEUE_FULL, ProblemKind.NOT_READY),
)
async def create_batch(runtime: RuntimeDependency, principal: Planner, asked: BatchCreate, response: Response) -> Batch:
    """Ask for many plans. All jobs are accepted, or none is; the answer comes once they are on disk."""
    new = [await order(runtime, principal, job, f"/jobs/{index}") for index, job in enumerate(asked.jobs)]
    batch_id = uuid4().hex
    rows, _ = await accept(runtime, principal, new, batch_id=batch_id)
    response.headers["Location"] = f"{PATH}/{batch_id}"
    return Batch(id=batch_id, states={"queued": len(rows)}, job_ids=[row.id for row in rows])


@router.get(
    PATH + "/{batch_id}",
    summary="Get a batch",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def get_batch(
    runtime: RuntimeDependency,
    principal: Reader,
    batch_id: Annotated[str, Path(description="Id of a batch.", max_length=64, pattern=r"^[A-Za-z0-9_-]+$")],
) -> Batch:
    """How the jobs of a batch stand together."""
    found = await runtime.jobs.batch(principal.owner, batch_id)
    if not found:
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is no batch {batch_id!r}.")
    states = Counter(state for _, state in found)
    return Batch(id=batch_id, states=dict(states), job_ids=[job_id for job_id, _ in found])
