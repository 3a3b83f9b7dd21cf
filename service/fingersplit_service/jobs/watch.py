"""Who waits for what becomes of a job: every change wakes them, nobody polls."""

import asyncio
import time
from collections import defaultdict
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from fingersplit_client.schemas import JobState
from fingersplit_service.database.rows import JobRow

__all__ = ["Change", "Progress", "Watch", "Watcher"]


@dataclass(frozen=True)
class Progress:
    """How far a running job is: what it does, and the share of the work done."""

    stage: str = "starting"
    share: float = 0.0


@dataclass(frozen=True)
class Change:
    """What happened to a job.

    Attributes:
        state: The state it has now.
        time: When, in seconds since 1970, UTC; a job's changes are in the order of their times.
        progress: How far it is, where that is the news.
        outcome: The job and its result document, where whoever tells has them; else they stand in the table.
    """

    state: JobState
    time: float
    progress: Progress | None = None
    outcome: tuple[JobRow, str] | None = None

    @property
    def ended(self) -> bool:
        """Whether nothing will come after it."""
        return self.state not in ("queued", "running")


class Watcher:
    """The changes of one job from the moment on at which the watcher was made."""

    def __init__(self) -> None:
        self._news: asyncio.Queue[Change | None] = asyncio.Queue()

    def tell(self, change: Change | None) -> None:
        """Add a change; None ends the watch."""
        self._news.put_nowait(change)

    async def changes(self, pause: float) -> AsyncIterator[Change | None]:
        """Every change until the last one; None whenever ``pause`` seconds went by without one."""
        while True:
            try:
                change = await asyncio.wait_for(self._news.get(), pause)
            except TimeoutError:
                yield None
                continue
            if change is None:
                return
            yield change
            if change.ended:
                return

    async def end(self, seconds: float) -> Change | None:
        """The change that ends the job; None when ``seconds`` are over before or the service stops."""
        try:
            async with asyncio.timeout(seconds):
                while (change := await self._news.get()) is not None:
                    if change.ended:
                        return change
        except TimeoutError:
            pass
        return None


class Watch:
    """All watchers, and the progress of running jobs, which no table has."""

    def __init__(self) -> None:
        self._watchers: defaultdict[str, set[Watcher]] = defaultdict(set)
        self._latest: dict[str, Change] = {}
        self._closed = False

    @contextmanager
    def watcher(self, job_id: str) -> Iterator[Watcher]:
        """Watch a job; begin before reading its state, and no change is missed."""
        watcher = Watcher()
        if self._closed:
            watcher.tell(None)
        self._watchers[job_id].add(watcher)
        try:
            yield watcher
        finally:
            watchers = self._watchers[job_id]
            watchers.discard(watcher)
            if not watchers:
                del self._watchers[job_id]

    def tell(
        self,
        job_id: str,
        state: JobState,
        progress: Progress | None = None,
        outcome: tuple[JobRow, str] | None = None,
    ) -> None:
        """Say what happened to a job; arguments as in `Change`."""
        change = Change(state, time.time(), progress, outcome)
        before = self._latest.get(job_id)
        if before is not None and change.time <= before.time:  # clocks are coarse, and are set back
            change = replace(change, time=before.time + 1e-6)
        if state == "running":
            self._latest[job_id] = change
        else:
            self._latest.pop(job_id, None)
        for watcher in self._watchers.get(job_id, ()):
            watcher.tell(change)

    def latest(self, job_id: str) -> Change | None:
        """The last change of a job that runs here."""
        return self._latest.get(job_id)

    def close(self) -> None:
        """Let everybody go: the service stops."""
        self._closed = True
        for watchers in self._watchers.values():
            for watcher in watchers:
                watcher.tell(None)
