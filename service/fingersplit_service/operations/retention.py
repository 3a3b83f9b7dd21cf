"""Deletes what nobody needs any more: old jobs, their files, and forgotten objects."""

import asyncio
import logging
import time
from typing import NoReturn

from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["Retention"]

_log = logging.getLogger(__name__)
_INTERVAL = 3_600.0  # between rounds [s]
_AT_ONCE = 500  # deleted in one transaction, so that jobs do not wait for it


class Retention:
    """Rounds of deletion.

    Args:
        jobs: The jobs.
        objects: The objects.
        storage: Their files.
        settings: How long things are kept.
    """

    def __init__(self, jobs: JobStore, objects: ObjectStore, storage: Storage, settings: ServiceSettings) -> None:
        self._jobs, self._objects, self._storage, self._settings = jobs, objects, storage, settings

    async def run(self) -> NoReturn:
        """A round at once and then every hour."""
        while True:
            try:
                await self.sweep(time.time())
            except (StorageUnavailable, OSError):
                _log.exception("Old data could not be deleted.")
            await asyncio.sleep(_INTERVAL)

    async def sweep(self, now: float) -> None:
        """Delete what is too old at ``now`` [s since 1970], and the oldest jobs' files where all take too much."""
        while ended := await self._jobs.delete_ended_before(now - self._settings.keep_jobs_s, _AT_ONCE):
            for job_id in ended:
                await asyncio.to_thread(self._storage.remove_job, job_id)
        for folder in await asyncio.to_thread(self._storage.job_folders_before, now - self._settings.keep_recordings_s):
            await asyncio.to_thread(self._storage.remove_job, folder)
        for folder in await asyncio.to_thread(self._storage.job_folders_beyond, self._settings.keep_recordings_bytes):
            await asyncio.to_thread(self._storage.remove_job, folder)
        for owner, object_id in await self._objects.unused_since(now - self._settings.keep_objects_s, _AT_ONCE):
            removal = await self._objects.remove(owner, object_id)
            if removal.last:
                await asyncio.to_thread(self._storage.remove_object, object_id)
