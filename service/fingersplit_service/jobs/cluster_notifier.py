"""News of jobs among machines: PostgreSQL's LISTEN and NOTIFY, and a look at the table behind it.

Notifications are lost behind poolers that share sessions, and while a connection is made anew. Nothing rests on them:
whoever waits for a job, and whoever waits for work, looks at the table twice a second.
"""

import asyncio
import json
import logging
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Collection
from contextlib import suppress
from typing import Any, NoReturn
from uuid import uuid4

import psycopg
import sqlalchemy as sa

from fingersplit_client.schemas import JobState
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.rows import JobRow
from fingersplit_service.jobs.notifier import Change, Notifier, Progress

__all__ = ["ClusterNotifier"]

_NEWS, _WORK = "fingersplit_news", "fingersplit_work"  # changes of jobs for replicas; jobs and cancels for agents
_LAZY = 0.02  # how long progress waits for the end of a short job, which then stands for it [s]
_POLL = 0.4  # between looks at the table [s]
_RETRY = 0.2  # before a connection is made anew [s]
_MAX_RUNNING = 10_000  # jobs of other machines whose progress is remembered
_MAX_OBJECTS = 50  # named in one message, which has 8,000 bytes at most
_SEND = "SELECT pg_notify(channel, message) FROM unnest(%s::text[], %s::text[]) AS sent(channel, message)"
_log = logging.getLogger(__name__)


def _ignore(*_: Any) -> None:
    """What is done with news that nobody wants."""


class ClusterNotifier(Notifier):
    """Subscriptions of this process to jobs that run anywhere.

    Args:
        jobs: The table.
        url: The database, by an address whose sessions are not shared.
        max_waiting: As of `Notifier`.
        runs_jobs: Whether this process runs jobs; it then hears of jobs that were queued and cancelled, else of
            everything that becomes of jobs.

    Attributes:
        on_queued: Called with the ids of the objects when jobs were queued somewhere; for a single job also with a
            number by which the machines that hear of it take turns, else with None.
        on_cancelled: Called with the id of a job that was cancelled somewhere.
    """

    def __init__(self, jobs: JobStore, url: sa.URL, max_waiting: int = 200, *, runs_jobs: bool) -> None:
        super().__init__(max_waiting)
        self._channel = _WORK if runs_jobs else _NEWS
        self.on_queued: Callable[[Collection[str], int | None], object] = _ignore
        self.on_cancelled: Callable[[str], object] = _ignore
        self._jobs = jobs
        self._address = url.set(drivername="postgresql").render_as_string(hide_password=False)
        self._origin = uuid4().hex[:12]
        # Channel and message by what they are about: the newest counts.
        self._unsent: OrderedDict[tuple[str, str], str] = OrderedDict()
        self._something, self._sent = asyncio.Event(), 0
        self._known: dict[str, tuple[Any, ...]] = {}  # what subscribers were told last of a job
        self._tasks: list[asyncio.Task[NoReturn]] = []

    def start(self) -> None:
        """Begin to listen, to send and to look."""
        acts = (self._listen, self._send)
        self._tasks = [asyncio.create_task(self._keep_connected(act)) for act in acts]
        self._tasks.append(asyncio.create_task(self._poll()))

    async def stop(self) -> None:
        """Send what is unsent, and end."""
        with suppress(TimeoutError):
            async with asyncio.timeout(1.0):
                while self._unsent:
                    await asyncio.sleep(0.01)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def publish(
        self,
        job_id: str,
        state: JobState,
        progress: Progress | None = None,
        outcome: tuple[JobRow, str] | None = None,
        *,
        followed_up: bool = False,
    ) -> None:
        """Tell subscribers here and on other machines."""
        change = self.deliver(job_id, Change(state, time.time(), progress, outcome, followed_up))
        message: dict[str, Any] = {"from": self._origin, "job": job_id, "state": state, "time": change.time}
        if progress is not None:
            message |= {"stage": progress.stage, "share": progress.share}
        if followed_up:
            message["followed_up"] = True
        self._post(_NEWS, f"{job_id} {followed_up}", message, lazy=state == "running")
        if state == "cancelled":
            self._post(_WORK, job_id, message)

    def publish_queued(self, objects: Collection[str]) -> None:
        """Say that jobs were queued, one for each of these objects; with none, that there may be some."""
        self._sent += 1
        message: dict[str, Any] = {"from": self._origin, "queued": list(dict.fromkeys(objects))[:_MAX_OBJECTS]}
        if len(objects) == 1:
            message["turn"] = self._sent
        self._post(_WORK, f"queued {self._sent}", message)

    def deliver(self, job_id: str, change: Change) -> Change:
        """Pass a change on to the subscribers here."""
        if len(self._latest) > _MAX_RUNNING:  # the news of their end was lost
            del self._latest[next(iter(self._latest))]
        if job_id in self._subscriptions and change.progress is None and not change.followed_up:
            self._known[job_id] = (change.state, self._known.get(job_id, ("", None))[1])
        return super().deliver(job_id, change)

    def _post(self, channel: str, about: str, message: dict[str, Any], *, lazy: bool = False) -> None:
        self._unsent.pop((channel, about), None)
        self._unsent[channel, about] = json.dumps(message, separators=(",", ":"))
        if lazy:
            asyncio.get_running_loop().call_later(_LAZY, self._something.set)
        else:
            self._something.set()

    async def _keep_connected(self, act: Callable[[Any], Awaitable[None]]) -> NoReturn:
        while True:
            try:
                connect = psycopg.AsyncConnection.connect(self._address, autocommit=True, connect_timeout=5)
                async with await connect as connection:
                    # A message that is lost with the database's machine was about what is lost with it.
                    await connection.execute("SET synchronous_commit TO off")
                    await act(connection)
            except (psycopg.Error, OSError) as error:
                _log.warning("The connection for notifications broke: %s", str(error).splitlines()[:1])
            await asyncio.sleep(_RETRY)

    async def _send(self, connection: "psycopg.AsyncConnection[Any]") -> None:
        while True:
            await self._something.wait()
            self._something.clear()
            unsent, self._unsent = self._unsent, OrderedDict()
            if unsent:
                channels = [channel for channel, _ in unsent]
                await connection.execute(_SEND, (channels, list(unsent.values())))

    async def _listen(self, connection: "psycopg.AsyncConnection[Any]") -> None:
        await connection.execute(f"LISTEN {self._channel}")
        async for one in connection.notifies():
            try:
                self._receive(json.loads(one.payload))
            except Exception:
                _log.exception("A notification could not be read.")

    def _receive(self, message: dict[str, Any]) -> None:
        if "queued" in message:
            self.on_queued(message["queued"], message.get("turn"))
            return
        if message["from"] == self._origin:
            return
        progress = Progress(message["stage"], message["share"]) if "stage" in message else None
        job_id, state = message["job"], message["state"]
        followed_up = bool(message.get("followed_up"))
        self.deliver(job_id, Change(state, message["time"], progress, None, followed_up))
        if state == "cancelled":
            self.on_cancelled(job_id)

    async def _poll(self) -> NoReturn:
        while True:
            await asyncio.sleep(_POLL)
            try:
                await self._look()
            except StorageUnavailable:
                continue
            except Exception:
                _log.exception("The jobs that are waited for could not be looked at.")

    async def _look(self) -> None:
        """Tell subscribers what the table says and no notification said."""
        wanted = list(self._subscriptions)
        self._known = {job_id: known for job_id, known in self._known.items() if job_id in self._subscriptions}
        if not wanted:
            return
        for row in await self._jobs.states(wanted):
            before, now = self._known.get(row.id), (row.state, row.verification)
            self._known[row.id] = now
            progress = Progress(row.stage, row.progress or 0.0) if row.stage and row.state == "running" else None
            if before is None and row.state == "queued":
                continue
            if before is None or before[0] != row.state:
                self.deliver(row.id, Change(row.state, time.time(), progress))
            elif before[1] != row.verification and row.verification in ("done", "failed") and before[1] is not None:
                self.deliver(row.id, Change(row.state, time.time(), None, None, followed_up=True))
            elif progress is not None and progress != self._progress(row.id):
                self.deliver(row.id, Change(row.state, time.time(), progress))

    def _progress(self, job_id: str) -> Progress | None:
        latest = self.latest(job_id)
        return latest.progress if latest else None
