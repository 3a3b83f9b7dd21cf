"""Verifies and records the first grasp of every run behind its answer, when nothing else wants a worker."""

import asyncio
import logging
from typing import NoReturn

from fingersplit_client.schemas import JobCreate
from fingersplit_service.blobs import BlobsUnavailable
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.follow_ups import FollowUp, FollowUpStore
from fingersplit_service.database.rows import JobRow
from fingersplit_service.jobs.notifier import Notifier
from fingersplit_service.jobs.verifying import VerifyTask
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerDied, WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage
from fingersplit_service.telemetry.logs import log_context

__all__ = ["FollowUps"]

_log = logging.getLogger(__name__)
_PAUSE = 1.0  # before the next look when the database could not be read [s]


class FollowUps:
    """Runs follow-ups. The table says which are pending, so none is lost when workers or the service die.

    Args:
        store: Where they are.
        storage: Where recordings go.
        pool: The workers.
        notifier: Who is told of it.
        functions: What workers run.
        settings: How many at once, and deadlines.
    """

    def __init__(
        self,
        store: FollowUpStore,
        storage: Storage,
        pool: WorkerPool,
        notifier: Notifier,
        functions: WorkerFunctions,
        settings: ServiceSettings,
    ) -> None:
        self._store, self._storage, self._pool = store, storage, pool
        self._notifier, self._functions, self._settings = notifier, functions, settings
        self._unseen = asyncio.Semaphore(0)
        self._runners: list[asyncio.Task[NoReturn]] = []

    async def start(self) -> None:
        """Begin with what is pending."""
        await self._store.begin()
        count = self._settings.workers + self._settings.spare_workers
        self._runners = [asyncio.create_task(self._run()) for _ in range(count)]
        self.wake()

    async def stop(self) -> None:
        """Begin nothing new; what is not finished stays pending."""
        for runner in self._runners:
            runner.cancel()
        await asyncio.gather(*self._runners, return_exceptions=True)

    def wake(self) -> None:
        """Say that there is something to follow up."""
        if self._unseen.locked():
            self._unseen.release()

    async def _run(self) -> NoReturn:
        while True:
            await self._unseen.acquire()
            try:
                while (claimed := await self._store.claim()) is not None:
                    self.wake()  # there may be more, for another runner
                    await self._follow_up(claimed)
            except StorageUnavailable:
                await asyncio.sleep(_PAUSE)
                self.wake()
            except Exception:
                _log.exception("A follow-up could not be claimed or ended.")

    async def _follow_up(self, claimed: FollowUp) -> None:
        job = claimed.job
        task = VerifyTask(job.id, job.object_name, JobCreate.model_validate_json(job.request), claimed.result)
        self._storage.job_folder(job.id).mkdir(parents=True, exist_ok=True)
        with log_context(job_id=job.id):
            row = None
            try:
                row = await self._verify(claimed, task)
            finally:
                if row is None:  # what is still pending, for whatever reason, is taken up again
                    await self._release(claimed)
            if row is not None:
                self._notifier.publish(job.id, "succeeded", followed_up=True)

    async def _release(self, claimed: FollowUp) -> None:
        while True:
            try:
                return await self._store.release(claimed)
            except StorageUnavailable:
                await asyncio.sleep(_PAUSE)

    async def _verify(self, claimed: FollowUp, task: VerifyTask) -> JobRow | None:
        """Have a worker do it; the job as it is then, None when it was deleted or could not be done now."""
        job = claimed.job
        try:
            verified = await self._pool.run_behind(
                self._functions.verify, self._storage, task, deadline_s=self._settings.plan_deadline_s
            )
        except WorkerDied:
            _log.warning("Job %s: the worker that verified its first grasp died.", job.id)
            return None
        except BlobsUnavailable as error:
            _log.warning("Job %s: its files are out of reach: %s", job.id, error)
            await asyncio.sleep(_PAUSE)
            return None
        except Exception as error:
            _log.warning("The first grasp of job %s could not be verified: %r", job.id, error)
            return await self._store.fail(claimed)
        return await self._store.finish(claimed, verified.result, verified.verified)
