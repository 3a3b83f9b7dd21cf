"""Deletes what is not needed any more: old jobs, their files, unused objects, and files without rows."""

import asyncio
import logging
import time
from collections.abc import Callable
from typing import NoReturn

from fingersplit_service.database.hands import HandStore
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["Retention"]

_log = logging.getLogger(__name__)
_INTERVAL = 3_600.0  # between rounds at most [s]
_AT_ONCE = 500  # deleted in one transaction, so that jobs do not wait for it


class Retention:
    """Rounds of deletion.

    Args:
        jobs: The jobs.
        objects: The objects.
        hands: The uploaded hands.
        storage: Their files.
        settings: How long things are kept.
        leads: Whether it is for this process to do it.
    """

    def __init__(
        self,
        jobs: JobStore,
        objects: ObjectStore,
        hands: HandStore,
        storage: Storage,
        settings: ServiceSettings,
        leads: Callable[[], bool] = lambda: True,
    ) -> None:
        self._leads = leads
        self._jobs, self._objects, self._hands = jobs, objects, hands
        self._storage, self._settings = storage, settings

    async def run(self) -> NoReturn:
        """A round at once, and then again and again."""
        while True:
            try:
                if self._storage.shared is not None:
                    await asyncio.to_thread(self._storage.forget_copies)
                if self._leads():
                    await self.sweep(time.time())
                    await self.sweep_orphans(time.time())
            except Exception:
                _log.exception("Old data could not be deleted.")
            await asyncio.sleep(min(_INTERVAL, self._settings.keep_orphans_s))

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
            await self._objects.remove(owner, object_id)

    async def sweep_orphans(self, now: float) -> None:
        """Delete files that nothing in the tables names, once they are older than the grace time.

        No request deletes an object's file: another owner may be uploading the same one at that moment. An upload
        renews the file's time before its row is written, and looks for the file afterwards.
        """
        before = now - self._settings.keep_orphans_s
        objects = await asyncio.to_thread(self._storage.objects_before, before)
        for object_id in await self._objects.without_rows(objects):
            if object_id in await asyncio.to_thread(self._storage.objects_before, before):
                await asyncio.to_thread(self._storage.remove_object, object_id)
        for hand_id in await self._hands.without_rows(await asyncio.to_thread(self._storage.hands_before, before)):
            if hand_id in await asyncio.to_thread(self._storage.hands_before, before):
                await asyncio.to_thread(self._storage.remove_hand, hand_id)
        folders = await asyncio.to_thread(self._storage.job_folders_before, before)
        for job_id in await self._jobs.without_rows(folders):
            await asyncio.to_thread(self._storage.remove_job, job_id)
