"""Warm worker processes for whoever needs one: slots that refill, and a queue for the free ones."""

import asyncio
import heapq
import itertools
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from enum import IntEnum
from typing import Any, TypeVar

from fingersplit_service.jobs.slot import DeadlineExceeded, ReportHandler, WorkerDied, WorkerSlot

__all__ = ["DeadlineExceeded", "Engine", "Priority", "ReportHandler", "WorkerDied"]

Returned = TypeVar("Returned")

_log = logging.getLogger(__name__)
_LONGEST_PAUSE = 30.0  # between attempts to start a worker [s]


class Priority(IntEnum):
    """Who gets the next free worker: someone waiting for an answer comes before the queue of jobs."""

    ANSWER = 0
    JOB = 1


class Engine:
    """A fixed number of warm worker processes.

    Args:
        workers: How many.
        memory_bytes: Largest address space of each.
        warm: Runs first in each new process; what it returns is kept in `warmth`.
        warm_deadline_s: Its longest time [s].

    Attributes:
        warmth: What ``warm`` returned last; None until the first worker is warm.
    """

    def __init__(
        self,
        workers: int,
        memory_bytes: int,
        warm: Callable[..., Any],
        warm_deadline_s: float,
    ) -> None:
        self.warmth: Any = None
        self._warm, self._warm_deadline_s = warm, warm_deadline_s
        self._slots = [WorkerSlot(memory_bytes) for _ in range(workers)]
        self._free: list[WorkerSlot] = []
        self._waiting: list[tuple[Priority, int, asyncio.Future[WorkerSlot]]] = []
        self._order = itertools.count()
        self._warm_slots: set[WorkerSlot] = set()
        self._never_warm = set(self._slots)
        self._keepers: list[asyncio.Task[None]] = []

    @property
    def ready(self) -> bool:
        """Whether every slot has been warm once and one has a worker now."""
        return not self._never_warm and bool(self._warm_slots)

    @property
    def warm_workers(self) -> int:
        """Number of workers that are warm, busy or not."""
        return len(self._warm_slots)

    def start(self) -> None:
        """Begin to fill all slots."""
        self._keepers = [asyncio.create_task(self._keep(slot)) for slot in self._slots]

    async def stop_refilling(self) -> None:
        """Start no more workers."""
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)

    async def stop(self) -> None:
        """Kill every worker."""
        await self.stop_refilling()
        await asyncio.gather(*(slot.discard() for slot in self._slots))

    @asynccontextmanager
    async def worker(self, priority: Priority) -> AsyncIterator[WorkerSlot]:
        """Have a free worker for oneself; waits for one."""
        while True:
            slot = await self._take(priority)
            if slot.usable:
                break
        process = slot.processes
        try:
            yield slot
        finally:
            if slot.processes == process:  # else its keeper has refilled it, and offers it when it is warm
                self._offer(slot)

    async def answer(self, function: Callable[..., Returned], *arguments: Any, deadline_s: float) -> Returned:
        """Run what somebody waits for in the next free worker; arguments and errors as `WorkerSlot.run`."""
        async with self.worker(Priority.ANSWER) as worker:
            return await worker.run(function, *arguments, deadline_s=deadline_s)

    async def _keep(self, slot: WorkerSlot) -> None:
        """Fill one slot, again and again as its processes die."""
        pause = 1.0
        while True:
            try:
                slot.start()
                self.warmth = await slot.run(self._warm, deadline_s=self._warm_deadline_s)
            except Exception:
                _log.exception("A worker process did not start; next attempt in %g s.", pause)
                await slot.discard()
                await asyncio.sleep(pause)
                pause = min(2 * pause, _LONGEST_PAUSE)
                continue
            pause = 1.0
            self._never_warm.discard(slot)
            self._warm_slots.add(slot)
            self._offer(slot)
            await slot.death()
            _log.warning("A worker process ended; starting another.")
            self._warm_slots.discard(slot)
            self._free = [other for other in self._free if other is not slot]
            await slot.discard()

    async def _take(self, priority: Priority) -> WorkerSlot:
        if self._free:
            return self._free.pop()
        turn: asyncio.Future[WorkerSlot] = asyncio.get_running_loop().create_future()
        heapq.heappush(self._waiting, (priority, next(self._order), turn))
        try:
            return await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._offer(turn.result())
            raise

    def _offer(self, slot: WorkerSlot) -> None:
        """Give a slot to the first who waits, or keep it free; an empty one its keeper brings back."""
        if not slot.usable:
            return
        while self._waiting:
            _, _, turn = heapq.heappop(self._waiting)
            if not turn.done():
                turn.set_result(slot)
                return
        self._free.append(slot)
