"""Jobs: queue, follow, wait for, cancel; and what they found."""

import builtins
from collections.abc import Callable, Sequence
from typing import Any, Generic

from pydantic import TypeAdapter

from fingersplit_client import _waiting
from fingersplit_client._events import JobEvent
from fingersplit_client._exchange import Deadline, given, parse, quoted
from fingersplit_client._flow import Emit, Flow, Stream
from fingersplit_client.grasps import Grasp, Link
from fingersplit_client.modes import Mode, operation, stream
from fingersplit_client.resources.resource import Resource
from fingersplit_client.results import Job
from fingersplit_client.schemas import JobCreate, JobPage, JobState, JobSummary, JobVerification

__all__ = ["Jobs"]

_GRASPS: Any = TypeAdapter(list[Grasp])


class Jobs(Resource[Mode], Generic[Mode]):
    """Plans, from the queue to the result."""

    @operation
    def create(self, request: JobCreate, *, wait: float = 0.0, idempotency_key: str | None = None) -> Flow[Job[Mode]]:
        """Queue a job.

        Args:
            request: What to plan.
            wait: How long the service may wait for the job's end before it answers [s].
            idempotency_key: With the same key a repeated call returns the first one's job; by default a new one, with
                which this call is repeated where its answer is lost.
        """
        return (yield from _waiting.create(self, request, wait, idempotency_key))

    @operation
    def get(self, job_id: str, *, wait: float = 0.0) -> Flow[Job[Mode]]:
        """Where a job stands, with its result once it has succeeded.

        Args:
            job_id: Id of the job.
            wait: How long the service may wait for the job's end before it answers [s].
        """
        return (yield from _waiting.get(self, job_id, wait))

    @operation
    def list(
        self,
        *,
        limit: int = 100,
        cursor: str | None = None,
        state: Sequence[JobState] = (),
        object_id: str | None = None,
        hand: str | None = None,
        batch_id: str | None = None,
        object_name: str | None = None,
    ) -> Flow[JobPage]:
        """A page of the jobs, newest first; ``next_cursor`` of one page is ``cursor`` of the next.

        Args:
            limit: How many to return at most.
            cursor: Where to go on.
            state: Only jobs in one of these states.
            object_id: Only jobs of this object.
            hand: Only jobs for this hand.
            batch_id: Only jobs of this batch.
            object_name: Only jobs whose object's name has this in it.
        """
        filters = given(
            object_id=object_id, hand=hand, batch_id=batch_id, object_name=object_name, limit=limit, cursor=cursor
        )
        response = yield from self._exchange("GET", "/v1/jobs", params=filters | {"state": [*state]})
        return parse(JobPage, response)

    @stream
    def all(
        self,
        *,
        state: Sequence[JobState] = (),
        object_id: str | None = None,
        hand: str | None = None,
        batch_id: str | None = None,
        object_name: str | None = None,
    ) -> Stream[JobSummary]:
        """Every job, newest first, page after page; filters as in `list`."""
        cursor = None
        while True:
            page = yield from Jobs.list.flow(
                self,
                limit=200,
                cursor=cursor,
                state=state,
                object_id=object_id,
                hand=hand,
                batch_id=batch_id,
                object_name=object_name,
            )
            for item in page.items:
                yield Emit(item)
            cursor = page.next_cursor
            if cursor is None:
                return

    @operation
    def cancel(self, job_id: str) -> Flow[Job[Mode]]:
        """End a job that has not ended; one that has stays as it is."""
        response = yield from self._exchange("POST", f"{_path(job_id)}/cancel", repeatable=True)
        return _waiting.linked(self, response)

    @operation
    def delete(self, job_id: str) -> Flow[None]:
        """Delete a job with its result, pictures and recordings; one that has not ended is cancelled first."""
        yield from self._exchange("DELETE", _path(job_id))

    @operation
    def wait(
        self,
        job: JobSummary | str,
        timeout: float = 300.0,
        *,
        cancel: bool = False,
        on_progress: Callable[[JobSummary], None] | None = None,
    ) -> Flow[Job[Mode]]:
        """Wait until a job has succeeded, on one connection.

        Args:
            job: A job of this service, or its id.
            timeout: How long to wait at most [s].
            cancel: Whether the job is cancelled where waiting ends before it: at the timeout, by Ctrl-C, or because the
                task that waits is cancelled.
            on_progress: Called with the job whenever its state or progress changes.

        Raises:
            JobFailed: It ended without a result.
            WaitTimeout: The time is over; the job goes on unless ``cancel`` says otherwise.
        """
        job_id = job if isinstance(job, str) else job.id
        return (yield from _waiting.wait_or_cancel(self, job_id, Deadline(timeout), cancel, on_progress))

    @stream
    def events(self, job_id: str, *, last_event_id: str | None = None) -> Stream[JobEvent]:
        """Follow a job until it has ended; a stream that breaks is taken up where it was.

        Args:
            job_id: Id of the job.
            last_event_id: The last event that was seen; only later ones come.
        """
        follower = _waiting.Follower(self, job_id, last_event_id)
        while (event := (yield from follower.next_event())) is not None:
            yield Emit(event)

    @operation
    def grasps(self, job_id: str) -> "Flow[builtins.list[Grasp[Mode]]]":
        """The ranked grasps of a job that has ended."""
        response = yield from self._exchange("GET", f"{_path(job_id)}/grasps")
        found: builtins.list[Grasp[Mode]] = _GRASPS.validate_json(response.content)
        for grasp in found:
            grasp._link = Link(self._mode(), job_id)
        return found

    @operation
    def verification(self, job_id: str) -> Flow[JobVerification]:
        """What simulation showed of a job's grasps."""
        response = yield from self._exchange("GET", f"{_path(job_id)}/verification")
        return parse(JobVerification, response)

    @operation
    def picture(self, job_id: str, rank: int = 1) -> Flow[bytes]:
        """PNG of one grasp of a job: hand and object at the start and at the end, and the quality curve."""
        response = yield from self._exchange("GET", f"{_path(job_id)}/grasps/{rank}/picture.png")
        return bytes(response.content)

    @operation
    def recording(self, job_id: str, rank: int = 1) -> Flow[bytes]:
        """Recording of one grasp of a job, for the Rerun viewer."""
        response = yield from self._exchange("GET", f"{_path(job_id)}/grasps/{rank}/recording.rrd")
        return bytes(response.content)

    @operation
    def export(self, job_id: str, format_name: str, *, rank: int | None = None) -> Flow[bytes]:
        """The feasible grasps of a job as a file of another tool, or one grasp, feasible or not."""
        path = f"{_path(job_id)}/export/{quoted(format_name)}"
        response = yield from self._exchange("GET", path, params=given(rank=rank))
        return bytes(response.content)


def _path(job_id: str) -> str:
    """Address of a job."""
    return f"/v1/jobs/{quoted(job_id)}"
