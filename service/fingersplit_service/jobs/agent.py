"""What a machine of several does beside running jobs: signs of life, looks for work, and jobs of silent machines."""

import asyncio
import logging
from collections.abc import Collection, Sequence
from contextlib import suppress
from typing import NoReturn

from fingersplit_service.database.cluster_queue import ClusterQueue
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.jobs.cluster_notifier import ClusterNotifier
from fingersplit_service.jobs.dispatcher import Dispatcher
from fingersplit_service.jobs.follow_ups import FollowUps
from fingersplit_service.jobs.worker_pool import WorkerPool

__all__ = ["Agent"]

_log = logging.getLogger(__name__)
_BEAT = 0.4  # between signs of life, which are looks for work, too [s]
_FOR_OTHERS = 0.01  # how long a job is left to a machine that may hold its object ready [s]
_FOR_TURN = 0.004  # how long it is left to the machine whose turn it is: two that look at once disturb each other [s]


class Agent:
    """Keeps an agent alive in the table.

    The signs of life come from the event loop that claims jobs: when it hangs, the machine counts as silent.

    Args:
        queue: The queue as this agent sees it.
        dispatcher: Runs jobs.
        follow_ups: Verifies behind answers.
        notifier: Brings news of other machines.
        pool: The workers.
        silence_s: After how long without a sign of life others take an agent's jobs [s].

    Attributes:
        leads: Whether it does what one agent does for all.
    """

    def __init__(
        self,
        queue: ClusterQueue,
        dispatcher: Dispatcher,
        follow_ups: FollowUps,
        notifier: ClusterNotifier,
        pool: WorkerPool,
        silence_s: float,
    ) -> None:
        self.leads = False
        self._alive: Sequence[str] = ()
        self._queue, self._dispatcher, self._follow_ups = queue, dispatcher, follow_ups
        self._notifier, self._pool, self._silence_s = notifier, pool, silence_s
        self._beating: asyncio.Task[NoReturn] | None = None
        self._heard_since: float | None = None  # since when the database has answered every time
        notifier.on_queued = self._queued
        notifier.on_cancelled = dispatcher.interrupt

    def start(self) -> None:
        """Begin; the agent is registered already."""
        self._beating = asyncio.create_task(self._beat_periodically())

    async def stop(self) -> None:
        """End, and let others have what is left at once."""
        if self._beating is not None:
            self._beating.cancel()
            await asyncio.gather(self._beating, return_exceptions=True)
        try:
            await self._queue.leave()
        except StorageUnavailable:
            _log.warning("The database does not answer; this agent will be missed in %g s.", self._silence_s)

    def _queued(self, objects: Collection[str], turn: int | None) -> None:
        """Look for work; a moment later where another machine may hold the object ready, or where it is its turn."""
        wait = 0.0 if self._pool.knows_any(objects) else _FOR_OTHERS
        if turn is not None and self._alive and self._alive[turn % len(self._alive)] != self._queue.agent:
            wait += _FOR_TURN
        if wait:
            asyncio.get_running_loop().call_later(wait, self._dispatcher.wake)
        else:
            self._dispatcher.wake()

    async def _beat_periodically(self) -> NoReturn:
        loop = asyncio.get_running_loop()
        while True:
            try:
                await self._beat(loop.time())
            except StorageUnavailable:
                self._heard_since = None
            except Exception:
                _log.exception("A sign of life could not be given.")
            await asyncio.sleep(_BEAT)

    async def _beat(self, now: float) -> None:
        if self._heard_since is None:
            self._heard_since = now
        beat = await self._queue.beat(self._dispatcher.running)
        self._alive = beat.alive
        self.leads = self._alive[:1] == [self._queue.agent]
        if not beat.known:
            _log.warning("This agent was silent for too long; others have taken its jobs.")
            for job_id in self._dispatcher.running:
                self._dispatcher.interrupt(job_id)
            await self._queue.register()
            self._heard_since = None
            return
        for job_id in beat.lost:
            self._dispatcher.interrupt(job_id)
        self._dispatcher.wake()
        self._follow_ups.wake()
        # When the database was away, nobody could give a sign of life: the others get the time to do so.
        if now - self._heard_since > self._silence_s:
            with suppress(StorageUnavailable):  # a silent machine may hold rows for a moment; the next beat tries again
                await self._rescue()

    async def _rescue(self) -> None:
        rescued = await self._queue.rescue(self._silence_s)
        for job_id in rescued.queued:
            _log.warning("Job %s waits again: the machine that ran it fell silent.", job_id)
            self._notifier.publish(job_id, "queued")
        for job_id in rescued.failed:
            self._notifier.publish(job_id, "failed")
        if rescued.queued:
            self._notifier.publish_queued([])
