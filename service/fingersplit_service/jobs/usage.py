"""Limits and use of owners, as the endpoints and the workers see them."""

import asyncio
import logging
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn

from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.usage import Limits, UsageStore, Used
from fingersplit_service.jobs.slot import WorkerSlot

__all__ = ["Meter", "UsageService"]

_INTERVAL = 1.0  # between entries in the table [s]
_log = logging.getLogger(__name__)


class Meter:
    """Adds up the CPU time of workers by owner; a process that dies loses what it used in the last second."""

    def __init__(self) -> None:
        self._seconds: defaultdict[str, float] = defaultdict(float)

    @contextmanager
    def measure(self, owner: str, slot: WorkerSlot) -> Iterator[None]:
        """Count what a worker uses inside for an owner; where the system does not say, the time on the clock."""
        process, cpu, began = slot.processes, slot.cpu_s, time.monotonic()
        try:
            yield
        finally:
            now = slot.cpu_s if slot.processes == process else None
            elapsed = time.monotonic() - began
            self._seconds[owner] += elapsed if now is None or cpu is None else max(0.0, now - cpu)

    def take(self) -> dict[str, float]:
        """What was used since the last call."""
        taken, self._seconds = self._seconds, defaultdict(float)
        return {owner: seconds for owner, seconds in taken.items() if seconds > 0}

    def put_back(self, seconds: dict[str, float]) -> None:
        """Take again what could not be written."""
        for owner, amount in seconds.items():
            self._seconds[owner] += amount


class UsageService:
    """What owners may do now, and have done.

    Args:
        store: The table.
        meter: What workers use.
        limits: Of every owner.
    """

    def __init__(self, store: UsageStore, meter: Meter, limits: Limits) -> None:
        self.limits = limits
        self._store, self._meter = store, meter
        self._writing: asyncio.Task[NoReturn] | None = None

    def start(self) -> None:
        """Begin to write what workers use."""
        self._writing = asyncio.create_task(self._write_periodically())

    async def stop(self) -> None:
        """Write what is left."""
        if self._writing is not None:
            self._writing.cancel()
            await asyncio.gather(self._writing, return_exceptions=True)
        with suppress(StorageUnavailable):
            await self._write()

    async def used(self, owner: str) -> Used:
        """What an owner uses now."""
        return await self._store.used(owner)

    async def admit(self, owner: str) -> None:
        """Let an owner have a worker, or not.

        Raises:
            LimitReached: It has used what it may.
        """
        if self.limits != Limits():
            await self._store.check(owner, self.limits)

    async def _write_periodically(self) -> NoReturn:
        while True:
            await asyncio.sleep(_INTERVAL)
            try:
                await self._write()
            except StorageUnavailable:
                continue
            except Exception:
                _log.exception("What owners use could not be written.")

    async def _write(self) -> None:
        seconds = self._meter.take()
        if not seconds:
            return
        try:
            await self._store.add_cpu(seconds)
        except StorageUnavailable:
            self._meter.put_back(seconds)
            raise
