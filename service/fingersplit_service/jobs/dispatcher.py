"""Hands queued jobs to free workers, as soon as there is one of each."""

import asyncio
import logging
from dataclasses import dataclass
from typing import NoReturn

from fingersplit.errors import FingersplitError
from fingersplit_client.schemas import JobError
from fingersplit_service.jobs.engine import DeadlineExceeded, Engine, Priority, WorkerDied
from fingersplit_service.jobs.slot import WorkerSlot
from fingersplit_service.jobs.store import JobRow, Store
from fingersplit_service.jobs.tasks import PlanTask
from fingersplit_service.jobs.worker import Report
from fingersplit_service.storage import Storage

__all__ = ["Dispatcher", "Progress"]

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Progress:
    """How far a running job is: what it does, and the share of the work done."""

    stage: str = "starting"
    share: float = 0.0


class Dispatcher:
    """Runs jobs. The table is the truth; here is only what a dying process may forget.

    Args:
        store: Where the jobs are.
        storage: Where their files are.
        engine: Where the workers are.
        runners: How many jobs may run at once.
        plan: What a worker runs for a job.
        deadline_s: Longest time of one job [s].
    """

    def __init__(
        self,
        store: Store,
        storage: Storage,
        engine: Engine,
        *,
        runners: int,
        plan: PlanTask,
        deadline_s: float,
    ) -> None:
        self._store, self._storage, self._engine = store, storage, engine
        self._plan, self._deadline_s = plan, deadline_s
        self._runners, self._tasks = runners, list[asyncio.Task[NoReturn]]()
        self._progress: dict[str, Progress] = {}
        self._wake = asyncio.Event()

    async def start(self) -> None:
        """Take up what a dead process left, and begin."""
        await self._store.take_up()
        self.wake()
        self._tasks = [asyncio.create_task(self._run_jobs()) for _ in range(self._runners)]

    async def stop(self) -> None:
        """Begin nothing new; running jobs go back to the queue for the next process."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def wake(self) -> None:
        """Say that a job was queued."""
        self._wake.set()

    def progress(self, job_id: str) -> Progress:
        """How far a running job is."""
        return self._progress.get(job_id, Progress())

    async def _run_jobs(self) -> NoReturn:
        while True:
            await self._wake.wait()
            async with self._engine.worker(Priority.JOB) as worker:
                self._wake.clear()  # before looking: a job that is queued meanwhile sets it again
                try:
                    job = await self._store.claim()
                    if job is not None:
                        self._wake.set()  # there may be more
                        await self._run(worker, job)
                except Exception:
                    _log.exception("A job could not be taken up or ended.")

    async def _run(self, worker: WorkerSlot, job: JobRow) -> None:
        try:
            outcome = await worker.run(
                self._plan,
                self._storage,
                job.id,
                job.object_id,
                job.object_name,
                job.request,
                deadline_s=self._deadline_s,
                on_report=lambda report: self._note(job, report),
            )
        except WorkerDied:
            if await self._store.count_worker_death(job.id):
                self.wake()
        except asyncio.CancelledError:
            await self._store.give_back(job.id)
            raise
        except Exception as error:
            if isinstance(error, MemoryError):
                worker.kill()  # what is left of its memory is not worth keeping
            await self._store.fail(job.id, _reason(job, error))
        else:
            await self._store.succeed(job.id, outcome.result, outcome.grasps)
        finally:
            self._progress.pop(job.id, None)

    def _note(self, job: JobRow, report: Report) -> None:
        self._progress[job.id] = Progress(report.stage, report.progress)


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
