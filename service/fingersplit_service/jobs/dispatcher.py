"""Hands queued jobs to free workers, as soon as there is one of each."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field, replace
from typing import NoReturn, TypeVar

from fingersplit.errors import FingersplitError
from fingersplit_client.schemas import JobError
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.queue import Queue
from fingersplit_service.database.rows import JobRow
from fingersplit_service.jobs.engine import DeadlineExceeded, Engine, Priority, Turn, WorkerDied
from fingersplit_service.jobs.planning import JobOrder, JobOutcome
from fingersplit_service.jobs.tasks import Tasks
from fingersplit_service.jobs.views import ViewOrder, draw_in_advance
from fingersplit_service.jobs.watch import Progress, Watch
from fingersplit_service.jobs.worker import Report, execute_behind
from fingersplit_service.operations.logs import log_context
from fingersplit_service.operations.metrics import Metrics
from fingersplit_service.operations.tracing import span
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["Dispatcher"]

_log = logging.getLogger(__name__)
_RETRY, _LONGEST_RETRY = 0.1, 5.0  # pauses between attempts to write to the database [s]
_PAUSE = 0.01  # [s] for the answer, and for the next job of the same client, before a run is recorded
_NICE_RECORDING = 10  # a job that runs meanwhile comes first
_KEPT_LATE = "The database could not be written when the job ended; its result was kept later."
_NOT_RECORDED = "The worker met a fault while it wrote what pictures and recordings need; there will be none."

Returned = TypeVar("Returned")


@dataclass(frozen=True)
class _Running:
    """A job that has a worker."""

    turn: Turn
    released: asyncio.Event = field(default_factory=asyncio.Event)


class Dispatcher:
    """Runs jobs. The table is the truth; here is only what a dying process may forget.

    Args:
        queue: Where the jobs are.
        storage: Where their files are.
        engine: Where the workers are.
        watch: Who is told what becomes of them.
        metrics: What is counted.
        settings: Number of workers and times.
        tasks: What workers run for a job.
    """

    def __init__(
        self,
        queue: Queue,
        storage: Storage,
        engine: Engine,
        watch: Watch,
        metrics: Metrics,
        settings: ServiceSettings,
        tasks: Tasks,
    ) -> None:
        self._queue, self._storage, self._engine, self._watch, self._metrics = queue, storage, engine, watch, metrics
        self._settings, self._work = settings, tasks
        self._tasks = list[asyncio.Task[NoReturn]]()
        self._running: dict[str, _Running] = {}
        self._unseen, self._idle = asyncio.Semaphore(0), asyncio.Event()
        self._stopping = False
        self._idle.set()

    async def start(self) -> None:
        """Take up what a dead process left, and begin."""
        await self._queue.take_up(alone=self._settings.database_url is None)
        self.wake()
        runners = [self._run_jobs() for _ in range(self._settings.workers)]
        self._tasks = [asyncio.create_task(task) for task in (*runners, self._keep_leases())]

    async def stop(self) -> None:
        """Begin nothing new; jobs that do not end in time go back to the queue for the next process."""
        self._stopping = True
        try:
            await asyncio.wait_for(self._idle.wait(), self._settings.stop_grace_s)
        except TimeoutError:
            _log.info("%d running jobs go back to the queue.", len(self._running))
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def wake(self) -> None:
        """Say that a job was queued: one who runs jobs looks, and if there are more, the next one does."""
        if self._unseen.locked():
            self._unseen.release()

    def interrupt(self, job_id: str) -> None:
        """Free the core of a job that was cancelled, at once, whatever its worker does."""
        running = self._running.get(job_id)
        if running is not None:
            running.turn.worker.kill()

    async def released(self, job_id: str) -> None:
        """Wait until no worker has to do with a job any more: one that has ended may still be recorded."""
        running = self._running.get(job_id)
        if running is not None:
            await running.released.wait()

    async def _run_jobs(self) -> NoReturn:
        while True:
            await self._unseen.acquire()  # before looking: a job that is queued meanwhile is looked for again
            if self._stopping:
                await asyncio.Event().wait()  # for the end of this task
            async with self._engine.worker(Priority.JOB) as turn:
                if self._stopping:
                    continue
                try:
                    job = await self._queue.claim()
                    if self._queue.more:
                        self.wake()
                    if job is not None:
                        await self._run(turn, job)
                except StorageUnavailable:
                    asyncio.get_running_loop().call_later(_RETRY, self.wake)
                except Exception:
                    _log.exception("A job could not be taken up or ended.")

    async def _run(self, turn: Turn, job: JobRow) -> None:
        running = self._running[job.id] = _Running(turn)
        self._idle.clear()
        try:
            with log_context(job_id=job.id), span("job", job_id=job.id, object_id=job.object_id, hand=job.hand):
                self._metrics.waited.observe(max(0.0, (job.started_at or 0.0) - job.created_at))
                self._watch.tell(job.id, "running", Progress())
                turn.prefer(job.object_id)
                await self._attempt(turn, job)
        finally:
            del self._running[job.id]
            running.released.set()
            if not self._running:
                self._idle.set()

    async def _attempt(self, turn: Turn, job: JobRow) -> None:
        limit = self._settings.plan_deadline_s
        deadline = limit if job.deadline_s is None else min(limit, job.deadline_s)
        began = time.monotonic()
        order = JobOrder(job.id, job.object_id, job.object_name, job.request, deadline)
        try:
            outcome = await turn.worker.run(
                self._work.plan,
                self._storage,
                order,
                deadline_s=deadline,
                on_report=lambda report: self._note(job, report),
            )
        except WorkerDied:
            _log.warning("Job %s: its worker died.", job.id)
            again = await _insist(lambda _late: self._queue.count_worker_death(job.id))
            self._ended(job, "queued" if again else "failed")
        except asyncio.CancelledError:
            await self._queue.give_back(job.id)
            self._watch.tell(job.id, "queued")
            raise
        except Exception as error:
            if isinstance(error, MemoryError):
                turn.worker.kill()  # what is left of its memory is not worth keeping
            reason = _reason(job, error)
            await _insist(lambda _late: self._queue.fail(job.id, reason))
            self._ended(job, "failed")
        else:
            self._metrics.ran.observe(time.monotonic() - began)
            if await self._keep(job, outcome) and outcome.unrecorded:
                await self._record(turn, job, outcome.pictured)

    async def _keep(self, job: JobRow, outcome: JobOutcome) -> bool:
        """Keep a result and tell of it; False for a job that somebody ended or deleted meanwhile."""

        async def keep(late: bool) -> JobRow | None:
            warnings = (*outcome.finding.warnings, *([_KEPT_LATE] if late else []))
            return await self._queue.succeed(job.id, replace(outcome.finding, warnings=warnings))

        kept = await _insist(keep)
        if kept is None:
            return False
        self._ended(job, "succeeded", (kept, outcome.finding.result))
        self._metrics.observe_result(outcome)
        return True

    async def _record(self, turn: Turn, job: JobRow, pictured: int | None) -> None:
        """Have the worker write what pictures need, while the answer is on its way and another has the next job."""
        if not self._queue.more:
            await asyncio.sleep(_PAUSE)
        deadline = self._settings.picture_deadline_s
        try:
            arguments = self._work.record, self._storage, job.id
            warnings = await turn.worker.run(execute_behind, _NICE_RECORDING, *arguments, deadline_s=deadline)
        except WorkerDied:
            _log.warning("Job %s was not recorded: its worker died.", job.id)
            warnings = [_NOT_RECORDED]
        except Exception:
            _log.exception("Job %s could not be recorded.", job.id)
            warnings = [_NOT_RECORDED]
        if warnings:
            await _insist(lambda _late: self._queue.warn(job.id, warnings))
        elif pictured is not None:  # for the lists, once nobody waits any more
            order = ViewOrder("thumbnail.webp", job.id, pictured, job.object_id, job.object_name, None)
            self._engine.run_idly(draw_in_advance, self._work.draw, self._storage, order, deadline_s=deadline)

    def _ended(self, job: JobRow, state: str, outcome: tuple[JobRow, str] | None = None) -> None:
        """Tell of a job's new state, unless somebody cancelled it, which was told then."""
        if self._watch.latest(job.id) is None:
            return
        if state == "queued":
            self.wake()
            self._watch.tell(job.id, "queued")
            return
        self._metrics.ended.labels(state).inc()
        self._watch.tell(job.id, "failed" if state == "failed" else "succeeded", outcome=outcome)

    def _note(self, job: JobRow, report: Report) -> None:
        if self._watch.latest(job.id) is not None:
            self._watch.tell(job.id, "running", Progress(report.stage, report.progress))

    async def _keep_leases(self) -> NoReturn:
        """Extend the leases of what runs here, and take up what other processes let go."""
        while True:
            await asyncio.sleep(self._settings.lease_s / 3)
            try:
                if self._running:
                    await self._queue.extend_leases(list(self._running))
                if await self._queue.take_up(alone=False):
                    self.wake()
            except StorageUnavailable:
                _log.warning("Leases could not be extended.")


async def _insist(write: Callable[[bool], Awaitable[Returned]]) -> Returned:
    """Write to the database, again and again until it can be written; ``write`` is told whether it is late."""
    pause, late = _RETRY, False
    while True:
        try:
            return await write(late)
        except StorageUnavailable:
            late = True
            await asyncio.sleep(pause)
            pause = min(2 * pause, _LONGEST_RETRY)


def _reason(job: JobRow, error: Exception) -> JobError:
    """Why a job failed, without anything of the inside."""
    if isinstance(error, FingersplitError):
        return JobError(code="refused", detail=str(error))
    if isinstance(error, DeadlineExceeded):
        return JobError(code="deadline_exceeded", detail=str(error))
    if isinstance(error, MemoryError):
        return JobError(code="out_of_memory", detail="It needed more memory than a worker may have.")
    _log.error("Job %s met a fault.", job.id, exc_info=error)
    return JobError(code="internal", detail="The planner met a fault; the log of the service says more.")
