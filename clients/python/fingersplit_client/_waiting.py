"""Jobs from the queue to their end: waiting on one connection, following, cancelling what nobody waits for any more."""

import time
from collections.abc import Callable
from typing import Any
from uuid import uuid4

import httpx2

from fingersplit_client._events import EventReader, JobEvent
from fingersplit_client._exchange import Deadline, Policy, dump, exchange, parse, quoted
from fingersplit_client._flow import Flow, NextLine, Pause
from fingersplit_client.errors import ApiError, FingersplitClientError, JobFailed, ServiceUnreachable, WaitTimeout
from fingersplit_client.grasps import Link
from fingersplit_client.modes import Bound
from fingersplit_client.results import Job
from fingersplit_client.retries import Retries
from fingersplit_client.schemas import JobCreate, JobSummary

__all__ = ["Follower", "Progress", "cancel_quietly", "create", "get", "linked", "run", "wait_or_cancel"]

Progress = Callable[[JobSummary], None]
"""Called with the job whenever its state or progress changes."""

_LONGEST_WAIT = 25.0
"""For one answer, below what something between us and the service would cut [s]."""
_SILENCE = 40.0
"""Longest time without a sign of life on a stream of events; the service gives one every 15 s [s]."""
_MIN_WAIT = 0.02
"""An answer that comes sooner though the job goes on did not wait; the next is asked for after a pause [s]."""
_UNWAITED_PAUSE = 0.25
_CLEANUP_TIMEOUT = 5.0
"""How long to wait for the answer to a cancellation that nobody wants to wait for [s]."""


def create(
    bound: Bound[Any], request: JobCreate, wait: float, key: str | None = None, deadline: Deadline | None = None
) -> Flow[Job[Any]]:
    """Queue a job, and wait for its end at most ``wait`` seconds."""
    headers = _prefer(wait) | {"Idempotency-Key": key or uuid4().hex}
    response = yield from bound._exchange(
        "POST", "/v1/jobs", json=dump(request), headers=headers, longer=wait, repeatable=True, deadline=deadline
    )
    return linked(bound, response)


def get(bound: Bound[Any], job_id: str, wait: float = 0.0, deadline: Deadline | None = None) -> Flow[Job[Any]]:
    """Where a job stands, now or when it has ended."""
    response = yield from bound._exchange(
        "GET", f"/v1/jobs/{quoted(job_id)}", headers=_prefer(wait), longer=wait, deadline=deadline
    )
    return linked(bound, response)


def linked(bound: Bound[Any], response: httpx2.Response) -> Job[Any]:
    """The job in a response, which knows its client."""
    job = parse(Job, response)
    job._link = Link(bound._mode(), job.id)
    if job.result is not None:
        job.result.linked(job._link)
    return job


def run(
    bound: Bound[Any],
    request: JobCreate,
    deadline: Deadline,
    *,
    cancel: bool,
    on_progress: Progress | None = None,
    on_job: Callable[[str], None] | None = None,
    key: str | None = None,
) -> Flow[Job[Any]]:
    """Queue a job and wait until it has succeeded; when nobody waits any more it is cancelled, if that is wanted."""
    key = key or uuid4().hex
    at_once = 0.0 if on_progress or on_job else min(_LONGEST_WAIT, deadline.left)
    job: Job[Any] | None = None
    try:
        job = yield from create(bound, request, at_once, key, deadline)
        if on_job is not None:
            on_job(job.id)
        return (yield from _wait(bound, job, deadline, on_progress))
    except BaseException as error:
        if not cancel or not _leaves_job(error):
            raise
        if job is None:  # it may have been queued all the same; the key finds it
            job = yield from _quietly(bound, lambda once: create(once, request, 0.0, key))
        ended = None if job is None else (yield from cancel_quietly(bound, job.id))
        return _after_cancelling(error, ended, deadline)


def wait_or_cancel(
    bound: Bound[Any], job_id: str, deadline: Deadline, cancel: bool, on_progress: Progress | None
) -> Flow[Job[Any]]:
    """Wait until a job has succeeded; see `run`."""
    try:
        job = yield from get(bound, job_id, 0.0 if on_progress else min(_LONGEST_WAIT, deadline.left), deadline)
        return (yield from _wait(bound, job, deadline, on_progress))
    except BaseException as error:
        if not cancel or not _leaves_job(error):
            raise
        return _after_cancelling(error, (yield from cancel_quietly(bound, job_id)), deadline)


def cancel_quietly(bound: Bound[Any], job_id: str) -> Flow[Job[Any] | None]:
    """Cancel a job if that works at the first attempt; as it stands then."""

    def cancel(once: Bound[Any]) -> Flow[Job[Any]]:
        response = yield from once._exchange("POST", f"/v1/jobs/{quoted(job_id)}/cancel")
        return linked(bound, response)

    return (yield from _quietly(bound, cancel))


def _wait(bound: Bound[Any], job: Job[Any], deadline: Deadline, on_progress: Progress | None) -> Flow[Job[Any]]:
    """Wait until a job has ended; the service answers as soon as it has."""
    if on_progress is not None:
        yield from _follow(bound, job, deadline, on_progress)
        job = yield from get(bound, job.id)
    while not job.ended:
        if not deadline.left:
            raise WaitTimeout(job, deadline.timeout)
        asked = time.monotonic()
        try:
            job = yield from get(bound, job.id, min(_LONGEST_WAIT, deadline.left), deadline)
        except WaitTimeout:
            raise WaitTimeout(job, deadline.timeout) from None
        if not job.ended and time.monotonic() - asked < _MIN_WAIT:
            yield Pause(min(_UNWAITED_PAUSE, deadline.left))
    if job.state != "succeeded":
        raise JobFailed(job)
    return job


def _follow(bound: Bound[Any], job: Job[Any], deadline: Deadline, on_progress: Progress) -> Flow[None]:
    """Report a job's progress until it has ended."""
    on_progress(job)
    seen: JobSummary = job
    follower = Follower(bound, job.id, None, deadline)
    while seen.state in ("queued", "running"):
        try:
            event = yield from follower.next_event()
        except WaitTimeout:
            raise WaitTimeout(seen, deadline.timeout) from None
        if event is None:
            return
        if event.job.state != seen.state or event.job.stage != seen.stage or event.job.progress != seen.progress:
            on_progress(event.job)
        seen = event.job
        if not deadline.left and seen.state in ("queued", "running"):
            raise WaitTimeout(seen, deadline.timeout)


class Follower:
    """Reads the events of a job; a stream that breaks is opened again where it was.

    Args:
        bound: The client.
        job_id: Id of the job.
        last_event_id: The last event that was seen; None for all.
        deadline: When the time to follow is over.
    """

    def __init__(
        self, bound: Bound[Any], job_id: str, last_event_id: str | None, deadline: Deadline | None = None
    ) -> None:
        self._bound, self._job_id, self._deadline = bound, job_id, deadline
        self._last, self._ended = last_event_id, False
        self._reader: EventReader | None = None
        self._failures = 0

    def next_event(self) -> Flow[JobEvent | None]:
        """The next event; None when the job has ended.

        Raises:
            WaitTimeout: The deadline is over.
        """
        while True:
            if self._ended:
                return None
            if self._reader is None:
                yield from self._open()
            try:
                event = yield from self._read()
            except httpx2.TransportError as error:
                yield from self._recover(error)
                continue
            if event is None:  # the job has ended, or the service stops
                return None
            self._failures, self._last = 0, event.id
            self._ended = event.job.state in ("succeeded", "failed", "cancelled")
            return event

    def _open(self) -> Flow[None]:
        path = f"/v1/jobs/{quoted(self._job_id)}/events"
        headers = {"Last-Event-ID": self._last} if self._last else {}
        policy = self._bound._policy
        silent = Policy(policy.base_url, _SILENCE, policy.retries)
        yield from exchange(silent, "GET", path, headers=headers, opened=True, deadline=self._deadline)
        self._reader = EventReader()

    def _read(self) -> Flow[JobEvent | None]:
        assert self._reader is not None  # opened before
        while (line := (yield NextLine())) is not None:
            event = self._reader.read(line)
            if event is not None:
                return event
            if self._deadline is not None and not self._deadline.left:
                raise WaitTimeout(None, self._deadline.timeout)
        self._reader = None
        return None

    def _recover(self, error: httpx2.TransportError) -> Flow[None]:
        if self._deadline is not None and not self._deadline.left:
            raise WaitTimeout(None, self._deadline.timeout) from error
        retries = self._bound._policy.retries
        pause = retries.pause_after_failure(error, self._failures, repeatable=True)
        if pause is None and not isinstance(error, httpx2.ReadTimeout):
            raise ServiceUnreachable(f"The events of job {self._job_id} broke off: {error}") from error
        self._failures += 1
        self._reader = None
        yield Pause(pause or 0.0)


class _Once(Bound[Any]):
    """Asks once and does not wait long: for what is done on the way out."""

    def __init__(self, bound: Bound[Any]) -> None:
        self._asking = bound

    def _mode(self) -> Any:
        return self._asking._mode()

    @property
    def _policy(self) -> Policy:
        return Policy(self._asking._policy.base_url, _CLEANUP_TIMEOUT, Retries(attempts=1))


def _quietly(bound: Bound[Any], ask: Callable[[Bound[Any]], Flow[Job[Any]]]) -> Flow[Job[Any] | None]:
    try:
        return (yield from ask(_Once(bound)))
    except FingersplitClientError:
        return None


def _leaves_job(error: BaseException) -> bool:
    """Whether a job may go on after this, so that it should be cancelled."""
    return not isinstance(error, JobFailed | ApiError | ServiceUnreachable)


def _after_cancelling(error: BaseException, job: Job[Any] | None, deadline: Deadline) -> Job[Any]:
    """The job, where it has succeeded at the last moment."""
    if isinstance(error, WaitTimeout) and job is not None:
        if job.state == "succeeded":
            return job
        raise WaitTimeout(job, deadline.timeout) from None
    raise error


def _prefer(seconds: float) -> dict[str, str]:
    return {"Prefer": f"wait={seconds:.6g}"} if seconds > 0 else {}
