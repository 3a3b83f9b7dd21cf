"""A job's progress as server-sent events."""

from collections.abc import AsyncIterator
from typing import Annotated, Any, get_args

from fastapi import APIRouter, Header
from fastapi.responses import StreamingResponse

from fingersplit_client.schemas import JobState
from fingersplit_service.database.rows import JobRow
from fingersplit_service.endpoints.documents import JobId, known_job, summarize
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency
from fingersplit_service.security.access import Principal, Reader

__all__ = ["router"]

router = APIRouter(tags=["jobs"])
_STATES = list(get_args(JobState))
_EVENT = {
    "type": "object",
    "properties": {
        "id": {"type": "string", "description": "Microseconds since 1970, UTC."},
        "event": {"enum": _STATES, "description": "The job's state."},
        "data": {"type": "string", "contentMediaType": "application/json", "description": "A `JobSummary`."},
    },
}
_STREAM: dict[int | str, dict[str, Any]] = {
    200: {"description": "The events, as they happen.", "content": {"text/event-stream": {"schema": _EVENT}}}
}
_PAUSE = 15.0  # after which a comment keeps the connection open [s]


class _EventResponse(StreamingResponse):
    """Server-sent events."""

    media_type = "text/event-stream"


@router.get(
    "/v1/jobs/{job_id}/events",
    response_class=_EventResponse,
    summary="Follow a job",
    responses=_STREAM | problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def follow_job(
    runtime: RuntimeDependency,
    principal: Reader,
    job_id: JobId,
    last_event_id: Annotated[
        str | None, Header(description="Id of the last event that was seen; later ones are sent.", max_length=40)
    ] = None,
) -> _EventResponse:
    """Changes of state and progress until the job has ended.

    An event's name is the job's state, its data the `JobSummary`. Ids are microseconds since 1970, UTC, so a stream
    that broke goes on where it was, also after a restart of the service.
    """
    await known_job(runtime, principal, job_id)
    seen = int(last_event_id) if last_event_id and last_event_id.isascii() and last_event_id.isdigit() else 0
    return _EventResponse(_events(runtime, principal, job_id, seen))


async def _events(runtime: Runtime, principal: Principal, job_id: str, seen: int) -> AsyncIterator[str]:
    with runtime.watch.watcher(job_id) as watcher:
        found = await runtime.jobs.get(principal.owner, job_id)
        if found is None:  # deleted meanwhile
            return
        row, _ = found
        for state, moment in _past(runtime, row):
            if _id(moment) > seen:
                seen = _id(moment)
                yield _event(runtime, row, state, seen)
        if row.ended:
            return
        async for change in watcher.changes(_PAUSE):
            if change is None:
                yield ": still here\n\n"
            elif _id(change.time) > seen:
                seen = _id(change.time)
                if row.state != change.state or change.progress is None:  # else only the progress is new
                    found = await runtime.jobs.get(principal.owner, job_id)
                    if found is None:
                        return
                    row, _ = found
                yield _event(runtime, row, change.state, seen)


def _past(runtime: Runtime, row: JobRow) -> list[tuple[str, float]]:
    """What has happened to a job so far, as far as it is known: states, with times [s since 1970]."""
    past: list[tuple[str, float | None]] = [("queued", row.created_at), ("running", row.started_at)]
    latest = runtime.watch.latest(row.id)
    if row.state == "running" and latest is not None:
        past.append(("running", latest.time))
    elif row.ended:
        past.append((row.state, row.finished_at))
    return [(state, moment) for state, moment in past if moment is not None]


def _id(moment: float) -> int:
    return int(moment * 1e6)


def _event(runtime: Runtime, row: JobRow, state: str, number: int) -> str:
    return f"id: {number}\nevent: {state}\ndata: {summarize(runtime, row).model_dump_json()}\n\n"
