"""Hands queued jobs to free workers, as soon as there is one of each."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import NoReturn, TypeVar

from fingersplit.errors import FingersplitError
from fingersplit_client.schemas import JobCreate, JobError
from fingersplit_service.blobs import BlobsUnavailable
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.queue import JobQueue
from fingersplit_service.database.rows import JobRow
from fingersplit_service.jobs.follow_ups import FollowUps
from fingersplit_service.jobs.notifier import Notifier, Progress
from fingersplit_service.jobs.outcome import JobOutcome
from fingersplit_service.jobs.planning import PlanTask
from fingersplit_service.jobs.rendering import RenderTask, render_in_advance
from fingersplit_service.jobs.usage import Meter
from fingersplit_service.jobs.worker import Report
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import DeadlineExceeded, WorkerDied, WorkerLease, WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage
from fingersplit_service.telemetry.logs import log_context
from fingersplit_service.telemetry.metrics import Metrics
from fingersplit_service.telemetry.tracing import span

__all__ = ["Dispatcher"]

_log = logging.getLogger(__name__)
_RETRY, _MAX_RETRY = 0.1, 5.0  # pauses between attempts to write to the database [s]
_STORE_PAUSE = 1.0  # after files could not be read [s]
_KEPT_LATE = "The database could not be written when the job ended; its result was kept later."

Returned = TypeVar("Returned")


class Dispatcher:
    """Runs jobs. The table is the truth; here is only what a dying process may forget.

    Args:
        queue: Where the jobs are.
        storage: Where their files are.
        pool: Where the workers are.
        notifier: Who is told what becomes of them.
        metrics: What is counted.
        settings: Number of workers and times.
        functions: What workers run for a job.
        follow_ups: Who verifies the first grasp of a run behind its answer.
        meter: Counts what workers use.
    """

    def __init__(
        self,
        queue: JobQueue,
        storage: Storage,
        pool: WorkerPool,
        notifier: Notifier,
        metrics: Metrics,
        settings: ServiceSettings,
        functions: WorkerFunctions,
        follow_ups: FollowUps,
        meter: Meter,
    ) -> None:
        self._queue, self._storage, self._pool, self._notifier = queue, storage, pool, notifier
        self._metrics, self._settings, self._functions = metrics, settings, functions
        self._follow_ups, self._meter = follow_ups, meter
        self._runners = list[asyncio.Task[NoReturn]]()
        self._running: dict[tuple[str, int], WorkerLease | None] = {}  # by id and attempt; None once the worker is free
        self._unseen, self._idle = asyncio.Semaphore(0), asyncio.Event()
        self._stopping = False
        self._idle.set()

    async def start(self) -> None:
        """Take over what a process that ended left running, and begin."""
        await self._queue.begin()
        self.wake()
        self._runners = [asyncio.create_task(self._run_jobs()) for _ in range(self._settings.workers)]

    def stop_claiming(self) -> None:
        """Begin nothing new."""
        self._stopping = True

    async def stop(self) -> None:
        """Begin nothing new; jobs that do not end in time go back to the queue for the next process."""
        self.stop_claiming()
        try:
            await asyncio.wait_for(self._idle.wait(), self._settings.stop_grace_s)
        except TimeoutError:
            _log.info("%d running jobs go back to the queue.", len(self._running))
        for runner in self._runners:
            runner.cancel()
        await asyncio.gather(*self._runners, return_exceptions=True)

    def wake(self, objects: Collection[str] = ()) -> None:  # noqa: ARG002 -- whose they are is seen when they are claimed
        """Say that a job was queued: one runner looks, and if there are more, the next one does."""
        if self._unseen.locked():
            self._unseen.release()

    def interrupt(self, job_id: str) -> None:
        """Free the core of a job that was cancelled, at once, whatever its worker does."""
        for (running, _), lease in list(self._running.items()):
            if running == job_id and lease is not None:
                lease.worker.kill()

    @property
    def running(self) -> dict[str, tuple[int, str | None, float | None]]:
        """What runs here, by job: the attempt, what it does and how much of it is done."""
        found = dict[str, tuple[int, str | None, float | None]]()
        for job_id, attempt in self._running:
            latest = self._notifier.latest(job_id)
            progress = latest.progress if latest else None
            found[job_id] = (attempt, progress.stage if progress else None, progress.share if progress else None)
        return found

    async def _run_jobs(self) -> NoReturn:
        while True:
            await self._unseen.acquire()  # before looking: a job that is queued meanwhile is looked for again
            if self._stopping:
                await asyncio.Event().wait()  # for the end of this task
            try:
                await self._run_next()
            except StorageUnavailable:
                asyncio.get_running_loop().call_later(_RETRY, self.wake)
            except Exception:
                _log.exception("A job could not be claimed or ended.")

    async def _run_next(self) -> None:
        """Run the next job; its worker is free before its end is written, however long that takes."""
        with ExitStack() as stack:
            async with self._pool.worker() as lease:
                if self._stopping:
                    return
                job = await self._queue.claim(self._pool.warm_objects(lease.worker))
                if self._queue.more:
                    self.wake()
                if job is None:
                    return
                lease.prefer(job.object_id)
                stack.enter_context(self._marked_as_running(job, lease))
                with self._meter.measure(job.owner, lease.worker):
                    write_end = await self._attempt(lease, job)
                self._running[job.id, job.attempts] = None
            await write_end()

    @contextmanager
    def _marked_as_running(self, job: JobRow, lease: WorkerLease) -> Iterator[None]:
        self._running[job.id, job.attempts] = lease
        self._idle.clear()
        try:
            with log_context(job_id=job.id), span("job", job_id=job.id, object_id=job.object_id, hand=job.hand):
                self._metrics.waited.observe(max(0.0, (job.started_at or 0.0) - job.created_at))
                self._notifier.publish(job.id, "running", Progress())
                yield
        finally:
            del self._running[job.id, job.attempts]
            if not self._running:
                self._idle.set()

    async def _attempt(self, lease: WorkerLease, job: JobRow) -> Callable[[], Awaitable[None]]:
        """Have the worker run the job; what is left to do is to write how that ended."""
        limit = self._settings.plan_deadline_s
        deadline = limit if job.deadline_s is None else min(limit, job.deadline_s)
        request = JobCreate.model_validate_json(job.request)
        threads = 1 + self._pool.idle_workers  # cores that nothing else wants
        began = time.monotonic()
        try:
            outcome = await lease.worker.run(
                self._functions.plan,
                self._storage,
                PlanTask(job.id, job.object_name, request, deadline, threads),
                deadline_s=deadline,
                on_report=lambda report: self._note(job, report),
            )
        except WorkerDied:
            _log.warning("Job %s: its worker died.", job.id)
            return partial(self._write_death, job)
        except asyncio.CancelledError:
            await self._queue.requeue(job)
            self._notifier.publish(job.id, "queued")
            raise
        except BlobsUnavailable as error:
            _log.warning("Job %s: its files are out of reach: %s", job.id, error)
            return partial(self._write_back, job)
        except Exception as error:
            if isinstance(error, MemoryError):
                lease.worker.kill()  # what is left of its memory is not worth keeping
            return partial(self._write_failure, job, _reason(job, error))
        self._metrics.ran.observe(time.monotonic() - began)
        return partial(self._write_result, job, outcome)

    async def _write_death(self, job: JobRow) -> None:
        state = await _retry(lambda _late: self._queue.count_worker_death(job))
        self._ended(job, state)

    async def _write_failure(self, job: JobRow, reason: JobError) -> None:
        failed = await _retry(lambda _late: self._queue.fail(job, reason))
        self._ended(job, "failed" if failed else None)

    async def _write_back(self, job: JobRow) -> None:
        """Queue a job again whose files cannot be read now; nothing else is begun here for a while."""
        queued = await _retry(lambda _late: self._queue.requeue(job))
        self._ended(job, "queued" if queued else None)
        await asyncio.sleep(_STORE_PAUSE)

    async def _write_result(self, job: JobRow, outcome: JobOutcome) -> None:
        """Keep a result and tell of it, unless the job was ended or deleted meanwhile."""
        request = JobCreate.model_validate_json(job.request)
        verify = self._settings.verify_first and request.verify_first and outcome.best_rank is not None

        async def keep(late: bool) -> JobRow | None:
            warnings = (*outcome.row.warnings, *([_KEPT_LATE] if late else []))
            row = replace(outcome.row, warnings=warnings)
            return await self._queue.succeed(job, row, verify=verify)

        kept = await _retry(keep)
        if kept is None:
            self._ended(job, None)
            return
        self._ended(job, "succeeded", (kept, outcome.row.result))
        self._metrics.observe_result(outcome.stage_ms, outcome.simulated)
        self._render_thumbnail(job, request, outcome)
        if verify:
            self._follow_ups.wake()

    def _render_thumbnail(self, job: JobRow, request: JobCreate, outcome: JobOutcome) -> None:
        """Have the small picture for lists made once nobody waits for a worker any more."""
        if outcome.best_rank is None or not request.recording:
            return
        task = RenderTask("thumbnail.webp", job.id, outcome.best_rank, job.object_name, request, outcome.row.result)
        self._storage.job_folder(job.id).mkdir(parents=True, exist_ok=True)  # a view is made only where it is there
        self._pool.run_idly(
            render_in_advance,
            self._functions.render,
            self._storage,
            task,
            deadline_s=self._settings.picture_deadline_s,
        )

    def _ended(self, job: JobRow, state: str | None, outcome: tuple[JobRow, str] | None = None) -> None:
        """Tell of a job's new state; None where it was not ours any more: cancelled, deleted or taken over."""
        if state is None:
            if (job.id, job.attempts + 1) not in self._running:
                self._notifier.forget(job.id)
            return
        if state == "queued":
            self.wake()
            self._notifier.publish(job.id, "queued")
            return
        self._metrics.ended.labels(state).inc()
        self._notifier.publish(job.id, "failed" if state == "failed" else "succeeded", outcome=outcome)

    def _note(self, job: JobRow, report: Report) -> None:
        if self._notifier.latest(job.id) is not None:
            self._notifier.publish(job.id, "running", Progress(report.stage, report.progress))


async def _retry(write: Callable[[bool], Awaitable[Returned]]) -> Returned:
    """Write to the database, again and again until it can be written; ``write`` is told whether it is late."""
    pause, late = _RETRY, False
    while True:
        try:
            return await write(late)
        except StorageUnavailable:
            late = True
            await asyncio.sleep(pause)
            pause = min(2 * pause, _MAX_RETRY)


def _reason(job: JobRow, error: Exception) -> JobError:
    """Why a job failed, without anything of the inside."""
    if isinstance(error, FingersplitError):
        return JobError(code="refused", detail=str(error))
    if isinstance(error, DeadlineExceeded):
        return JobError(code="deadline_exceeded", detail=str(error))
    if isinstance(error, MemoryError):
        return JobError(code="out_of_memory", detail="It needed more memory than a worker may have.")
    _log.error("Job %s failed with an internal error.", job.id, exc_info=error)
    return JobError(code="internal", detail="The planner failed with an internal error; the service's log says more.")
