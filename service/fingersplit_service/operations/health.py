"""Whether the service can do its work now, and its metrics."""

import asyncio
import shutil

from fingersplit_service.database.jobs import JobStore
from fingersplit_service.jobs.errors import WorkersNotReady
from fingersplit_service.jobs.notifier import Notifier
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.storage import Storage
from fingersplit_service.telemetry.metrics import Metrics

__all__ = ["DiskFull", "HealthService"]

_MIN_DISK = 16 * 2**20  # below which results could not be kept [bytes]


class DiskFull(Exception):  # noqa: N818
    """There is hardly any space left for data."""


class HealthService:
    """Looks at workers, database and disk.

    Args:
        jobs: The table of jobs.
        pool: The workers.
        storage: The data directory.
        notifier: Who waits.
        metrics: What is counted.

    Attributes:
        draining: Whether the service was told to stop and goes on answering for a while.
    """

    def __init__(
        self, jobs: JobStore, pool: WorkerPool, storage: Storage, notifier: Notifier, metrics: Metrics
    ) -> None:
        self._jobs, self._pool, self._storage = jobs, pool, storage
        self._notifier, self._metrics = notifier, metrics
        self.draining = False

    async def check(self) -> int:
        """Number of warm workers, if jobs are accepted and start without delay.

        Raises:
            WorkersNotReady: No worker is warm, or the service is about to stop.
            StorageUnavailable: The database does not answer.
            DiskFull: Results could not be kept.
        """
        if self.draining:
            raise WorkersNotReady("The service stops; send requests elsewhere.")
        if not self._pool.ready:
            raise WorkersNotReady("The workers are still starting; try again in a second.")
        await self._jobs.check()
        usage = await asyncio.to_thread(shutil.disk_usage, self._storage.root)
        if usage.free < _MIN_DISK:
            raise DiskFull(f"{usage.free >> 20} MiB are free for data; {_MIN_DISK >> 20} MiB are needed.")
        return self._pool.warm_workers

    async def metrics(self) -> bytes:
        """The text that Prometheus reads."""
        pool = self._pool
        return self._metrics.expose(
            jobs=await self._jobs.counts(),
            workers={"warm": pool.warm_workers, "spare": pool.spare_workers, "busy": pool.busy_workers},
            restarts=pool.restarts,
            waiting_requests=self._notifier.waiting,
            waiting_answers=pool.waiting_answers,
        )
