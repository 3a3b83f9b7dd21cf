"""A job's progress as server-sent events."""

from collections.abc import AsyncIterator
from typing import Annotated, Any, get_args

from fastapi import APIRouter, Header, Query, Request
from fastapi.responses import StreamingResponse

from fingersplit_client.schemas import JobState
from fingersplit_service.dependencies import Jobs
from fingersplit_service.endpoints.documents import JobId, summarize
from fingersplit_service.jobs.job_service import JobEvent, JobService
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader, identify

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
    request: Request,
    jobs: Jobs,
    principal: Reader,
    job_id: JobId,
    last_event_id: Annotated[
        str | None, Header(description="Id of the last event that was seen; later ones are sent.", max_length=40)
    ] = None,
    verification: Annotated[
        bool, Query(description="Go on after the job's end until its first grasp is verified, where that is pending.")
    ] = False,
) -> _EventResponse:
    """Changes of state and progress until the job has ended.

    An event's name is the job's state, its data the `JobSummary` as it was then. Ids are microseconds since 1970, UTC,
    so a stream that broke goes on where it was, also after a restart of the service.
    """
    await jobs.get(principal.owner, job_id)
    seen = int(last_event_id) if last_event_id and last_event_id.isascii() and last_event_id.isdigit() else 0
    return _EventResponse(_stream(request, jobs, principal.owner, job_id, seen, verification))


async def _stream(
    request: Request, jobs: JobService, owner: str, job_id: str, seen: int, verification: bool
) -> AsyncIterator[str]:
    """The events; a key that was revoked meanwhile ends them at the next sign of life."""
    async for event in jobs.events(owner, job_id, seen, verification=verification):
        if event is not None:
            yield _text(event)
            continue
        principal = await identify(request)
        if principal is None or principal.owner != owner:
            return
        yield ": still here\n\n"


def _text(event: JobEvent) -> str:
    job = event.job
    return f"id: {event.number}\nevent: {job.row.state}\ndata: {summarize(job).model_dump_json()}\n\n"
