"""Who waits for what becomes of a job: every change wakes them, nobody polls."""

import asyncio
import time
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from fingersplit_client.schemas import JobState
from fingersplit_service.database.rows import JobRow

__all__ = ["Change", "Notifier", "Progress", "Subscription", "TooManyWaiting"]


class TooManyWaiting(Exception):  # noqa: N818
    """Too many requests of one owner wait for jobs."""


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
        outcome: The job and its result document, where the publisher has them; else they stand in the table.
        followed_up: Whether the news is that the first grasp of an ended job was verified.
    """

    state: JobState
    time: float
    progress: Progress | None = None
    outcome: tuple[JobRow, str] | None = None
    followed_up: bool = False

    @property
    def ended(self) -> bool:
        """Whether nothing will come after it."""
        return self.state not in ("queued", "running")


class Subscription:
    """The changes of one job from the moment on at which the subscription was made."""

    def __init__(self) -> None:
        self._changes: asyncio.Queue[Change | None] = asyncio.Queue()

    def put(self, change: Change | None) -> None:
        """Add a change; None ends the subscription."""
        self._changes.put_nowait(change)

    async def changes(self, pause: float) -> AsyncIterator[Change | None]:
        """Every change until the service stops; None whenever ``pause`` seconds went by without one."""
        while True:
            try:
                change = await asyncio.wait_for(self._changes.get(), pause)
            except TimeoutError:
                yield None
                continue
            if change is None:
                return
            yield change

    async def end(self, seconds: float) -> Change | None:
        """The change that ends the job; None when ``seconds`` are over before or the service stops."""
        try:
            async with asyncio.timeout(seconds):
                while (change := await self._changes.get()) is not None:
                    if change.ended:
                        return change
        except TimeoutError:
            pass
        return None


class Notifier:
    """All subscriptions of this process, and the progress of running jobs, which no table has.

    Args:
        max_waiting: Most subscriptions of one owner at once.

    Attributes:
        closed: Whether the service stops, so that nothing can be waited for.
    """

    def __init__(self, max_waiting: int = 200) -> None:
        self._max_waiting, self._waiting = max_waiting, Counter[str]()
        self._subscriptions: defaultdict[str, set[Subscription]] = defaultdict(set)
        self._latest: dict[str, Change] = {}
        self.closed = False

    @contextmanager
    def subscribe(self, owner: str, job_id: str) -> Iterator[Subscription]:
        """Follow a job; begin before reading its state, and no change is missed.

        Raises:
            TooManyWaiting: The owner follows too many already.
        """
        if self._waiting[owner] >= self._max_waiting:
            raise TooManyWaiting(f"{self._max_waiting} of your requests wait for jobs already; end some, or poll.")
        subscription = Subscription()
        self._waiting[owner] += 1
        if self.closed:
            subscription.put(None)
        self._subscriptions[job_id].add(subscription)
        try:
            yield subscription
        finally:
            self._waiting[owner] -= 1
            if not self._waiting[owner]:
                del self._waiting[owner]
            subscriptions = self._subscriptions[job_id]
            subscriptions.discard(subscription)
            if not subscriptions:
                del self._subscriptions[job_id]

    def publish(
        self,
        job_id: str,
        state: JobState,
        progress: Progress | None = None,
        outcome: tuple[JobRow, str] | None = None,
        *,
        followed_up: bool = False,
    ) -> None:
        """Tell subscribers what happened to a job; arguments as in `Change`."""
        self.deliver(job_id, Change(state, time.time(), progress, outcome, followed_up))

    def deliver(self, job_id: str, change: Change) -> Change:
        """Pass a change on to the subscribers here; the change as they get it."""
        before = self._latest.get(job_id)
        if before is not None and change.time <= before.time:  # clocks are coarse, and are set back
            change = replace(change, time=before.time + 1e-6)
        if change.state == "running":
            self._latest[job_id] = change
        else:
            self._latest.pop(job_id, None)
        for subscription in self._subscriptions.get(job_id, ()):
            subscription.put(change)
        return change

    def forget(self, job_id: str) -> None:
        """Stop telling how far a job is, which ended without our doing."""
        self._latest.pop(job_id, None)

    def latest(self, job_id: str) -> Change | None:
        """The last change of a job that runs here."""
        return self._latest.get(job_id)

    @property
    def waiting(self) -> int:
        """Number of open subscriptions."""
        return sum(map(len, self._subscriptions.values()))

    def close(self) -> None:
        """End all subscriptions: the service stops."""
        self.closed = True
        for subscriptions in self._subscriptions.values():
            for subscription in subscriptions:
                subscription.put(None)
