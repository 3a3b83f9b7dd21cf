"""What several resources share: jobs as documents, pages, ids in paths."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Path, Query, Response

from fingersplit_client.schemas import JobSummary
from fingersplit_service.jobs.job_service import JobView

__all__ = [
    "ID_PATTERN",
    "Cursor",
    "JobId",
    "Limit",
    "ObjectId",
    "Rank",
    "job_document",
    "json_response",
    "next_cursor",
    "place",
    "summarize",
]

ID_PATTERN = r"^[A-Za-z0-9_-]+$"

JobId = Annotated[str, Path(description="Id of a job.", max_length=64, pattern=ID_PATTERN)]
ObjectId = Annotated[str, Path(description="Id of an object.", max_length=64, pattern=ID_PATTERN)]
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


def summarize(job: JobView) -> JobSummary:
    """A job as lists have it."""
    row, progress = job.row, job.progress
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
        verification=row.verification,
        created_at=_time(row.created_at),
        started_at=_time(row.started_at),
        finished_at=_time(row.finished_at),
        error=row.error,
        warnings=row.warnings,
    )


def job_document(job: JobView) -> str:
    """The ``Job`` document. Request and result are text already; parsing them would cost the event loop."""
    summary = summarize(job).model_dump_json()
    return f'{summary[:-1]},"request":{job.row.request},"result":{job.result or "null"}}}'


def json_response(document: str, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    """An answer whose document is text already."""
    return Response(document, status, headers, media_type="application/json")


def _time(seconds: float | None) -> Any:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
