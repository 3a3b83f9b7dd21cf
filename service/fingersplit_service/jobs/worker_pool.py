"""Warm worker processes: slots whose processes are replaced when they die, and fair turns for the free ones."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable, Collection
from contextlib import AbstractContextManager, asynccontextmanager, nullcontext
from typing import Any, TypeVar

from fingersplit_service.jobs.idle_work import IdleCall, IdleWork
from fingersplit_service.jobs.slot import DeadlineExceeded, ReportHandler, WorkerDied, WorkerSlot
from fingersplit_service.jobs.turns import JOBS, Turns
from fingersplit_service.jobs.warm_objects import WarmObjects
from fingersplit_service.jobs.worker import run_niced
from fingersplit_service.jobs.worker_functions import WarmUpReport

__all__ = ["DeadlineExceeded", "ReportHandler", "WorkerDied", "WorkerLease", "WorkerPool"]

Returned = TypeVar("Returned")

_log = logging.getLogger(__name__)
_MAX_PAUSE = 30.0  # between attempts to start a worker [s]
_NICE_STARTING = 10  # a worker that starts while others work gets at least a tenth of a core
_QUIET = 1.0  # without a request or a job, after which work behind answers may take workers that are not spare [s]
_WATCH_INTERVAL = 1.0  # between looks for stopped processes [s]


class WorkerLease:
    """The right to use one worker for a while.

    Attributes:
        worker: The worker.
    """

    def __init__(self, pool: "WorkerPool", worker: WorkerSlot) -> None:
        self._pool, self.worker = pool, worker
        self._process = worker.processes

    def prefer(self, object_id: str) -> None:
        """Exchange the worker for a free one that has worked on the same object, if there is one."""
        self.worker = self._pool.exchange(self.worker, object_id)
        self._process = self.worker.processes

    def end(self) -> None:
        """Give the worker back; one that was killed or replaced meanwhile comes back through its supervisor."""
        if self.worker.processes == self._process and self.worker.usable:
            self._pool.put_back(self.worker)
        self._pool.serve_next()


class WorkerPool:
    """A fixed number of warm worker processes that work at once, and spare ones that take over when one dies.

    Args:
        workers: How many work at once.
        spares: How many more are kept warm.
        memory_bytes: Largest address space of each.
        recycle_bytes: A worker that has grown beyond this is replaced when it is free.
        warm: Runs first in each new process.
        warm_deadline_s: Its longest time [s].
        silence_s: A process that the system reports as stopped for so long is killed [s].
        observe_wait: Called with the time that each answer waited for a worker [s].
        measure: Counts what a worker uses for the owner of an answer.

    Attributes:
        warm_up: What ``warm`` returned last; None until the first worker is warm.
        restarts: How many processes had to be replaced, by reason.
    """

    def __init__(
        self,
        workers: int,
        *,
        spares: int = 0,
        memory_bytes: int,
        recycle_bytes: int,
        warm: Callable[[], WarmUpReport],
        warm_deadline_s: float,
        silence_s: float = 5.0,
        observe_wait: Callable[[float], object] = bool,
        measure: Callable[[str, WorkerSlot], AbstractContextManager[None]] = lambda _owner, _slot: nullcontext(),
    ) -> None:
        self.warm_up: WarmUpReport | None = None
        self._measure = measure
        self.restarts = {"died": 0, "killed": 0, "grown": 0, "stopped": 0}
        self._warm, self._warm_deadline_s, self._recycle_bytes = warm, warm_deadline_s, recycle_bytes
        self._workers, self._silence_s, self._observe_wait = workers, silence_s, observe_wait
        self._slots = [WorkerSlot(memory_bytes) for _ in range(workers + spares)]
        self._free: list[WorkerSlot] = []
        self._objects = WarmObjects(self._slots)
        self._active = 0
        self._turns = Turns[WorkerSlot]()
        self._warm_slots: set[WorkerSlot] = set()
        self._was_warm = asyncio.Event()  # once as many were warm as work at once
        self._supervisors: list[asyncio.Task[None]] = []
        self._idle_work = IdleWork()
        self._last_use = 0.0  # when a worker was last in use for a request or a job
        self._idle_tasks: set[asyncio.Task[None]] = set()

    @property
    def ready(self) -> bool:
        """Whether all workers have been warm once and one is warm now."""
        return self._was_warm.is_set() and bool(self._warm_slots)

    @property
    def warm_workers(self) -> int:
        """Number of workers that are warm, busy or not, spare ones not counted."""
        return min(len(self._warm_slots), self._workers)

    @property
    def spare_workers(self) -> int:
        """Number of workers that are warm beyond those."""
        return max(0, len(self._warm_slots) - self._workers)

    @property
    def busy_workers(self) -> int:
        """Number of workers that are in use."""
        return self._active

    @property
    def idle_workers(self) -> int:
        """Number of workers that could begin to work now, spare ones not counted."""
        return min(len(self._free), self._workers - self._active)

    @property
    def waiting_answers(self) -> int:
        """Number of owners' requests that wait for a worker."""
        return self._turns.answers

    def start(self) -> None:
        """Begin to start the processes, the spare ones once the others are warm."""
        self._supervisors = [
            asyncio.create_task(self._supervise(place, slot)) for place, slot in enumerate(self._slots)
        ]
        self._supervisors.append(asyncio.create_task(self._kill_stopped()))

    async def stop_refilling(self) -> None:
        """Start no more workers, and end what nobody waits for."""
        self._idle_work.forget()
        ending = [*self._supervisors, *self._idle_tasks]
        for task in ending:
            task.cancel()
        await asyncio.gather(*ending, return_exceptions=True)

    async def stop(self) -> None:
        """Kill every worker."""
        await self.stop_refilling()
        await asyncio.gather(*(slot.discard() for slot in self._slots))

    @asynccontextmanager
    async def worker(self, client: str = JOBS) -> AsyncIterator[WorkerLease]:
        """Have a free worker for oneself; waits for one.

        Args:
            client: The owner that waits for an answer; by default the queue of jobs, which is fair itself.
        """
        lease = WorkerLease(self, await self._take(client))
        try:
            yield lease
        finally:
            self._active -= 1
            self._last_use = asyncio.get_running_loop().time()
            lease.end()
            self._look_again_when_quiet()

    async def answer(
        self,
        owner: str,
        function: Callable[..., Returned],
        *arguments: Any,
        deadline_s: float,
        object_id: str | None = None,
    ) -> Returned:
        """Run what an owner waits for in the next free worker; arguments and errors as `WorkerSlot.run`."""
        began = time.monotonic()
        async with self.worker(owner) as lease:
            self._observe_wait(time.monotonic() - began)
            if object_id is not None:
                lease.prefer(object_id)
            with self._measure(owner, lease.worker):
                return await lease.worker.run(function, *arguments, deadline_s=deadline_s)

    def run_idly(self, function: Callable[..., Any], *arguments: Any, deadline_s: float) -> None:
        """Have something done that nobody waits for, such as work in advance; it may also never be done.

        It is done by spare workers only, at the lowest priority, one after the other on each, and while it is done as
        many others are free as may begin to work. Without spare workers it waits for ever. The newest comes first: it
        is the likeliest to be wanted soon.
        """
        self._idle_work.add(IdleCall(function, arguments, deadline_s))
        self.serve_next()

    async def run_behind(self, function: Callable[..., Returned], *arguments: Any, deadline_s: float) -> Returned:
        """Have something done at the lowest priority that must be done some time; errors as `WorkerSlot.run`.

        Spare workers do it, in the order of the calls; when nothing else was asked for during a second, others do it,
        too, all but one.
        """
        answer: asyncio.Future[Returned] = asyncio.get_running_loop().create_future()
        self._idle_work.add(IdleCall(function, arguments, deadline_s, answer))
        self.serve_next()
        self._look_again_when_quiet()
        return await answer

    def warm_objects(self, slot: WorkerSlot) -> set[str]:
        """Ids of the objects that a worker or another free one has ready."""
        return self._objects.of((slot, *self._free))

    def knows_any(self, object_ids: Collection[str]) -> bool:
        """Whether a free worker has one of these objects ready."""
        return not self._objects.of(self._free).isdisjoint(object_ids)

    def exchange(self, slot: WorkerSlot, object_id: str) -> WorkerSlot:
        """A worker that has worked on an object: the given one, else a free one, else the given one all the same."""
        if not self._objects.has(slot, object_id):
            for place, other in enumerate(self._free):
                if self._objects.has(other, object_id):
                    self._free[place], slot = slot, other
                    break
        self._objects.note(slot, object_id)
        return slot

    def put_back(self, slot: WorkerSlot) -> None:
        """Make a worker free again, unless it has grown too large."""
        if slot.resident_bytes > self._recycle_bytes:
            _log.warning("A worker process has grown to %d MiB; replacing it.", slot.resident_bytes >> 20)
            slot.kill("grown")
            return
        self._free.append(slot)

    def serve_next(self) -> None:
        """Give free workers to those who wait, as many as may work at once, and idle work to the spare ones."""
        while self._free and self._active < self._workers:
            waiting = self._turns.next()
            if waiting is None:
                break
            self._active += 1
            waiting.set_result(self._free.pop())
        while (call := self._next_idle_call()) is not None:
            # The one that has been free longest: the others may have a job's object ready.
            lease = WorkerLease(self, self._free.pop(0))
            task = asyncio.create_task(self._run_idle_work(lease, call))
            self._idle_tasks.add(task)
            task.add_done_callback(self._idle_tasks.discard)

    def _next_idle_call(self) -> IdleCall | None:
        """Work that nobody waits for, if there is a worker to spare for it."""
        spare = len(self._free) > self._workers - self._active
        quiet = self._active == 0 and asyncio.get_running_loop().time() - self._last_use >= _QUIET
        room = len(self._idle_tasks) < max(1, len(self._slots) - 1)
        behind = bool(self._free) and (spare or (quiet and room))
        return self._idle_work.next(in_advance=spare and bool(self._free), behind=behind)

    def _look_again_when_quiet(self) -> None:
        if self._idle_work.has_work_behind:
            asyncio.get_running_loop().call_later(_QUIET + 0.01, self.serve_next)

    async def _run_idle_work(self, lease: WorkerLease, call: IdleCall) -> None:
        try:
            await call.run(lease.worker)
        finally:
            lease.end()

    async def _supervise(self, place: int, slot: WorkerSlot) -> None:
        """Keep a process in one slot, again and again as its processes die."""
        if place >= self._workers:
            await self._was_warm.wait()
        pause = 1.0
        while True:
            try:
                slot.start()
                niceness = _NICE_STARTING if self._warm_slots else 0
                report = await slot.run(run_niced, niceness, self._warm, deadline_s=self._warm_deadline_s)
            except Exception:
                _log.exception("A worker process did not start; next attempt in %g s.", pause)
                await slot.discard()
                await asyncio.sleep(pause)
                pause = min(2 * pause, _MAX_PAUSE)
                continue
            pause = 1.0
            self.warm_up = report
            if report.compiled:  # the compiler's memory stays with the process: a fresh one only loads
                await slot.discard()
                continue
            self._add_warm(slot)
            await slot.death()
            reason = slot.end_reason
            self.restarts[reason] += 1
            _log.warning("A worker process ended (%s); starting another.", reason)
            self._warm_slots.discard(slot)
            self._free = [other for other in self._free if other is not slot]
            self._objects.forget(slot)
            await slot.discard()

    async def _kill_stopped(self) -> None:
        """Kill processes that the system has stopped: they would never answer, and their jobs can run elsewhere."""
        since: dict[WorkerSlot, float] = {}
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(min(_WATCH_INTERVAL, self._silence_s / 3))
            stopped = {slot for slot in self._slots if slot.is_stopped}
            since = {slot: since.get(slot, loop.time()) for slot in stopped}
            for slot, moment in since.items():
                if loop.time() - moment >= self._silence_s:
                    _log.warning("A worker process has been stopped for %g s; replacing it.", self._silence_s)
                    slot.kill("stopped")

    def _add_warm(self, slot: WorkerSlot) -> None:
        self._warm_slots.add(slot)
        if len(self._warm_slots) >= self._workers:
            self._was_warm.set()
        self._free.append(slot)
        self.serve_next()

    async def _take(self, client: str) -> WorkerSlot:
        waiting = self._turns.wait(client)
        self.serve_next()
        try:
            return await waiting
        except asyncio.CancelledError:
            if waiting.done() and not waiting.cancelled():
                self._active -= 1
                WorkerLease(self, waiting.result()).end()
            raise
