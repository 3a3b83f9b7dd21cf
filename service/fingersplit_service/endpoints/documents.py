"""What several resources share: jobs as documents, pages, ids in paths."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Path, Query, Response

from fingersplit_client.schemas import JobSummary
from fingersplit_service.database.rows import JobRow
from fingersplit_service.jobs.watch import Progress
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime
from fingersplit_service.security.access import Principal

__all__ = [
    "Cursor",
    "JobId",
    "Limit",
    "ObjectId",
    "Rank",
    "job_document",
    "json_response",
    "known_job",
    "known_object",
    "next_cursor",
    "place",
    "summarize",
]

_ID = r"^[A-Za-z0-9_-]+$"

JobId = Annotated[str, Path(description="Id of a job.", max_length=64, pattern=_ID)]
ObjectId = Annotated[str, Path(description="Id of an object.", max_length=64, pattern=_ID)]
Rank = Annotated[int, Path(description="Rank of the grasp, from 1.")]
Limit = Annotated[int, Query(ge=1, le=1000, description="How many to return at most.")]
Cursor = Annotated[
    str | None, Query(description="`next_cursor` of the page before.", pattern=r"^[0-9]{1,18}$", max_length=18)
]


def place(cursor: str | None) -> int | None:
    """The place in the list that a cursor names."""
    return None if cursor is None else int(cursor)


def next_cursor(numbers: list[int], limit: int) -> str | None:
    """Cursor of the page after one with these places; None when it was the last."""
    return str(numbers[-1]) if len(numbers) == limit else None


def summarize(runtime: Runtime, row: JobRow) -> JobSummary:
    """A job as the table has it, with what only a running one has."""
    progress = None
    if row.state == "running":
        latest = runtime.watch.latest(row.id)
        progress = (latest.progress if latest else None) or Progress()
    # Constructed without validation: lists are long, and every value comes from the table.
    return JobSummary.model_construct(
        id=row.id,
        object_id=row.object_id,
        object_name=row.object_name,
        hand=row.hand,
        state=row.state,
        stage=progress.stage if progress else None,
        progress=progress.share if progress else float(row.state == "succeeded"),
        priority=row.priority,
        attempts=row.attempts,
        batch_id=row.batch_id,
        grasps=row.grasps,
        feasible=row.feasible,
        verified=row.verified,
        holding_margin=row.holding_margin,
        created_at=_time(row.created_at),
        started_at=_time(row.started_at),
        finished_at=_time(row.finished_at),
        error=row.error,
        warnings=row.warnings,
    )


def job_document(runtime: Runtime, row: JobRow, result: str | None) -> str:
    """The ``Job`` document. Request and result are text already; parsing them would cost the event loop."""
    summary = summarize(runtime, row).model_dump_json()
    return f'{summary[:-1]},"request":{row.request},"result":{result or "null"}}}'


def json_response(document: str, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    """An answer whose document is text already."""
    return Response(document, status, headers, media_type="application/json")


async def known_job(runtime: Runtime, principal: Principal, job_id: str) -> tuple[JobRow, str | None]:
    """A job and its result.

    Raises:
        ProblemError: Whoever asks has no such job.
    """
    found = await runtime.jobs.get(principal.owner, job_id)
    if found is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is no job {job_id!r}.")
    return found


async def known_object(runtime: Runtime, principal: Principal, object_id: str) -> str:
    """An object's document, JSON.

    Raises:
        ProblemError: Whoever asks has no such object.
    """
    document = await runtime.objects.document(principal.owner, object_id)
    if document is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is no object {object_id!r}; upload its mesh to /v1/objects.")
    return document


def _time(seconds: float | None) -> Any:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
