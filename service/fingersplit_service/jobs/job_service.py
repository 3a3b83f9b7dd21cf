"""Jobs as the endpoints see them: submit, look, wait, follow, cancel, delete."""

import asyncio
import hashlib
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass, replace
from typing import Any
from uuid import uuid4

from fingersplit_client.schemas import JobCreate, JobState
from fingersplit_service.database.jobs import JobFilter, JobStore, UnknownObject
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.rows import JobRow, NewJob
from fingersplit_service.database.usage import Limits
from fingersplit_service.jobs.errors import InvalidField, NotFound
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.job_requests import new_job
from fingersplit_service.jobs.job_runner import JobRunner
from fingersplit_service.jobs.notifier import Change, Notifier, Progress
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage
from fingersplit_service.telemetry.metrics import Metrics

__all__ = ["JobEvent", "JobService", "JobView"]


@dataclass(frozen=True)
class JobView:
    """A job as it stands.

    Attributes:
        row: The job.
        result: Its result document, JSON; None until it has succeeded.
        progress: How far it is, while it runs.
        fresh: Whether this call made it; False where an idempotency key found it.
    """

    row: JobRow
    result: str | None = None
    progress: Progress | None = None
    fresh: bool = True


@dataclass(frozen=True)
class JobEvent:
    """A change of a job: when [microseconds since 1970, UTC], and how the job stood then."""

    number: int
    job: JobView


class JobService:
    """What can be done with jobs; every method acts for one owner, and nobody finds another's job.

    Args:
        jobs: The table.
        objects: The objects they are for.
        hands: The hands that are known.
        runner: Who runs them.
        notifier: Who tells what becomes of them.
        storage: Their files.
        metrics: What is counted.
        settings: Limits.
    """

    def __init__(
        self,
        jobs: JobStore,
        objects: ObjectStore,
        hands: HandCatalog,
        runner: JobRunner,
        notifier: Notifier,
        storage: Storage,
        metrics: Metrics,
        settings: ServiceSettings,
    ) -> None:
        self._jobs, self._objects, self._hands, self._runner = jobs, objects, hands, runner
        self._notifier, self._storage, self._metrics, self._settings = notifier, storage, metrics, settings
        self._limits = Limits.of(settings)

    async def submit(
        self, owner: str, request: JobCreate, *, idempotency_key: str | None = None, wait_s: float = 0.0
    ) -> JobView:
        """Queue a job; once this returns it is on disk, and it is not lost.

        Args:
            owner: Whose it is.
            request: What to plan.
            idempotency_key: With it, a second call finds the first one's job.
            wait_s: How long to wait for its end [s].

        Raises:
            InvalidField, QueueFull, LimitReached, IdempotencyConflict, WorkersNotReady: It is not accepted.
        """
        new = await new_job(self._objects, self._hands, owner, request)
        if not wait_s:
            (row,), fresh = await self._accept(owner, [new], idempotency_key=idempotency_key)
            return JobView(row) if fresh else replace(await self.get(owner, row.id), fresh=False)
        with self._notifier.subscribe(owner, new.id) as subscription:
            (row,), fresh = await self._accept(owner, [new], idempotency_key=idempotency_key)
            end = await subscription.end(wait_s) if fresh else None
        if not fresh:
            return replace(await self.wait(owner, row.id, wait_s), fresh=False)
        if end is not None:
            return await self._ended_view(owner, row.id, end)
        return await self.get(owner, row.id)

    async def submit_batch(
        self, owner: str, requests: Sequence[JobCreate], *, idempotency_key: str | None = None
    ) -> tuple[str, list[JobRow], bool]:
        """Queue many jobs, all or none; the batch's id, the jobs, and whether they are new. Raises as `submit`."""
        new = [
            await new_job(self._objects, self._hands, owner, request, f"/jobs/{index}")
            for index, request in enumerate(requests)
        ]
        digest = hashlib.sha256(" ".join(job.request_hash for job in new).encode()).hexdigest()
        new[0] = replace(new[0], request_hash=digest)  # the job that carries the batch's idempotency key
        rows, fresh = await self._accept(owner, new, batch_id=uuid4().hex, idempotency_key=idempotency_key)
        assert rows[0].batch_id is not None  # what they were queued with
        return rows[0].batch_id, rows, fresh

    async def check(self, owner: str, request: JobCreate, prefix: str = "") -> None:
        """Refuse what `submit` would refuse, but for limits; ``prefix`` is where it stands, as a JSON pointer."""
        await new_job(self._objects, self._hands, owner, request, prefix)

    async def submit_as(
        self, owner: str, request: JobCreate, job_id: str, *, batch_id: str, idempotency_key: str
    ) -> None:
        """Queue a job of a batch under an id of the caller's; a second call does nothing. Raises as `submit`."""
        new = replace(await new_job(self._objects, self._hands, owner, request), id=job_id)
        await self._accept(owner, [new], batch_id=batch_id, idempotency_key=idempotency_key)

    async def batches(self, owner: str, before: int | None, limit: int) -> list[tuple[int, str, dict[JobState, int]]]:
        """Batches of an owner, newest first, older than the place ``before``: place, id and counts by state."""
        return await self._jobs.batches(owner, before, limit)

    async def get(self, owner: str, job_id: str) -> JobView:
        """A job as it stands.

        Raises:
            NotFound: The owner has no such job.
        """
        found = await self._jobs.get(owner, job_id)
        if found is None:
            raise NotFound(f"There is no job {job_id!r}.")
        return self._view(*found)

    async def page(self, owner: str, which: JobFilter, before: int | None, limit: int) -> list[JobView]:
        """Jobs of an owner, newest first, older than the place ``before``, without requests and results."""
        return [self._view(row) for row in await self._jobs.page(owner, which, before, limit)]

    async def batch(self, owner: str, batch_id: str) -> list[tuple[str, JobState]]:
        """Ids and states of a batch's jobs in their order.

        Raises:
            NotFound: The owner has no such batch.
        """
        found = await self._jobs.batch(owner, batch_id)
        if not found:
            raise NotFound(f"There is no batch {batch_id!r}.")
        return found

    async def wait(self, owner: str, job_id: str, seconds: float) -> JobView:
        """A job when it has ended, or as it stands when the time is over.

        Raises:
            NotFound: The owner has no such job.
        """
        view = await self.get(owner, job_id)
        if view.row.ended or not seconds:
            return view
        with self._notifier.subscribe(owner, job_id) as subscription:
            view = await self.get(owner, job_id)  # again: it may have ended before the subscription
            if view.row.ended:
                return view
            end = await subscription.end(seconds)
        return await (self.get(owner, job_id) if end is None else self._ended_view(owner, job_id, end))

    async def events(
        self, owner: str, job_id: str, seen: int, *, verification: bool = False
    ) -> AsyncIterator[JobEvent | None]:
        """What happened to a job after the event ``seen``, until it has ended; None as a sign of life.

        With ``verification`` until also its first grasp is verified, where that is pending.

        Each event carries the job as it stood then. Ends without an event when the job is not there.
        """
        with self._notifier.subscribe(owner, job_id) as subscription:
            found = await self._jobs.get(owner, job_id)
            if found is None:
                return
            view = self._view(*found)
            for moment, past in self._past(view):
                if _microseconds(moment) > seen:
                    seen = _microseconds(moment)
                    yield JobEvent(seen, past)
            if self._is_complete(view, verification):
                return
            told = view.row.state
            async for change in subscription.changes(self._settings.keepalive_s):
                if change is None:
                    yield None
                elif _microseconds(change.time) > seen or change.state != told:
                    seen = max(seen + 1, _microseconds(change.time))  # clocks of machines differ
                    if view.row.state != change.state or change.progress is None:  # else only the progress is new
                        found = await self._jobs.get(owner, job_id)
                        if found is None:
                            return
                        view = self._view(*found)
                    yield JobEvent(seen, _as_of_state(view, change.state, change.progress))
                    told = change.state
                    if told == view.row.state and self._is_complete(view, verification):
                        return

    async def cancel_batch(self, owner: str, batch_id: str) -> list[tuple[str, JobState]]:
        """End all jobs of a batch that have not ended, and free their workers; ids and states of all.

        Raises:
            NotFound: The owner has no such batch.
        """
        self._announce_cancelled(await self._jobs.cancel_batch(owner, batch_id))
        return await self.batch(owner, batch_id)

    async def cancel(self, owner: str, job_id: str) -> JobView:
        """End a job that has not ended, and free its worker; one that has ended stays as it is.

        Raises:
            NotFound: The owner has no such job.
        """
        view = await self.get(owner, job_id)
        if view.row.ended:
            return view
        row = await self._jobs.cancel(owner, job_id)
        if row is not None and row.state == "cancelled":
            self._announce_cancelled([job_id])
        return await self.get(owner, job_id)

    async def delete(self, owner: str, job_id: str) -> None:
        """Delete a job with its result and files; one that has not ended is cancelled first.

        Raises:
            NotFound: The owner has no such job.
        """
        await self.cancel(owner, job_id)
        await self._jobs.delete(owner, job_id)
        await asyncio.to_thread(self._storage.remove_job, job_id)

    async def _accept(
        self, owner: str, new: Sequence[NewJob], *, batch_id: str | None = None, idempotency_key: str | None = None
    ) -> tuple[list[JobRow], bool]:
        try:
            accepted = await self._jobs.add(
                owner,
                new,
                longest_queue=self._settings.max_queued_jobs,
                limits=self._limits,
                batch_id=batch_id,
                idempotency_key=idempotency_key,
            )
        except UnknownObject as error:
            place, object_id = error.args
            field = "/object_id" if batch_id is None else f"/jobs/{place}/object_id"
            raise InvalidField(field, f"There is no object {object_id!r}; upload it to /v1/objects first.") from error
        self._runner.wake([job.object_id for job in new])
        return accepted

    def _announce_cancelled(self, job_ids: Sequence[str]) -> None:
        for job_id in job_ids:
            self._notifier.publish(job_id, "cancelled")
            self._runner.interrupt(job_id)
            self._metrics.ended.labels("cancelled").inc()

    async def _ended_view(self, owner: str, job_id: str, end: Change) -> JobView:
        return JobView(*end.outcome) if end.outcome else await self.get(owner, job_id)

    @staticmethod
    def _is_complete(view: JobView, verification: bool) -> bool:
        return view.row.ended and not (verification and view.row.verification == "pending")

    def _view(self, row: JobRow, result: str | None = None) -> JobView:
        progress = None
        if row.state == "running":
            latest = self._notifier.latest(row.id)
            progress = (latest.progress if latest else None) or Progress(row.stage or "starting", row.progress or 0.0)
        return JobView(row, result, progress)

    def _past(self, view: JobView) -> list[tuple[float, JobView]]:
        """What has happened to a job so far, as far as it is known, with times [s since 1970]."""
        row = view.row
        accepted = replace(_as_of_state(view, "queued").row, started_at=None, attempts=0)
        past = [(row.created_at, JobView(accepted))]
        if row.started_at is not None and row.state != "queued":
            past.append((row.started_at, _as_of_state(view, "running", Progress())))
        latest = self._notifier.latest(row.id)
        if row.state == "running" and latest is not None:
            past.append((latest.time, view))
        elif row.ended and row.finished_at is not None:
            past.append((row.finished_at, view))
        return past


def _as_of_state(view: JobView, state: JobState, progress: Progress | None = None) -> JobView:
    """A job as it stood when it was in a state that it may have left since."""
    row = view.row
    if state == row.state:
        return replace(view, progress=progress or view.progress)
    unknown: dict[str, Any] = {
        "finished_at": None,
        "grasps": None,
        "feasible": None,
        "verified": None,
        "holding_margin": None,
    }
    return JobView(replace(row, state=state, error=None, warnings=[], **unknown), None, progress)


def _microseconds(moment: float) -> int:
    return int(moment * 1e6)
