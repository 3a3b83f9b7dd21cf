"""One warm worker process. No other module knows that pebble runs it.

Each slot has a pool of one process: pebble's workers share a pipe and a lock, and one that dies holding them
stalls the others. A pool whose process has died is never used again: a death while idle leaves it in error
for good.
"""

import asyncio
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, TypeVar

from pebble import ProcessExpired, ProcessPool

from fingersplit_service.jobs.worker import Report, Started, begin, execute

__all__ = ["DeadlineExceeded", "ReportHandler", "WorkerDied", "WorkerSlot"]

Returned = TypeVar("Returned")
ReportHandler = Callable[[Report], None]
EndReason = Literal["died", "killed", "grown", "stopped"]

_PAGE = os.sysconf("SC_PAGE_SIZE")
_TICKS = os.sysconf("SC_CLK_TCK")
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
_WORKER_ENVIRONMENT = _ONE_THREAD | {"MUJOCO_GL": "disable"}  # nothing is drawn with OpenGL


class WorkerDied(Exception):  # noqa: N818
    """The worker process ended in the middle of a call."""


class DeadlineExceeded(Exception):  # noqa: N818
    """A call took too long; its worker was killed."""


class WorkerSlot:
    """Owns at most one worker process; `start` starts it, and once it has died another can be started.

    Args:
        memory_bytes: Largest address space of the process.

    Attributes:
        processes: How many processes it has had.
        end_reason: Why the process ended, once it has.
    """

    def __init__(self, memory_bytes: int) -> None:
        self.processes = 0
        self._memory_bytes = memory_bytes
        self._pool: ProcessPool | None = None
        self._reports: Connection | None = None
        self._death: asyncio.Future[None] | None = None
        self._pid: int | None = None
        self._killed = False
        self.end_reason: EndReason = "died"
        self._call = 0
        self._on_report: ReportHandler | None = None

    @property
    def usable(self) -> bool:
        """Whether a process is there and meant to stay."""
        return not self._killed and self._death is not None and not self._death.done()

    @property
    def resident_bytes(self) -> int:
        """Memory that the process has in use; 0 where the system does not say."""
        try:
            return int(Path(f"/proc/{self._pid}/statm").read_text().split()[1]) * _PAGE
        except (OSError, IndexError):
            return 0

    @property
    def cpu_s(self) -> float | None:
        """CPU time of the process so far [s]; None where the system does not say."""
        try:
            with open(f"/proc/{self._pid}/stat", "rb") as file:
                fields = file.read().rpartition(b")")[2].split()
        except OSError:
            return None
        return (int(fields[11]) + int(fields[12])) / _TICKS

    @property
    def is_stopped(self) -> bool:
        """Whether the system has stopped the process, so that it neither works nor answers."""
        try:
            return Path(f"/proc/{self._pid}/stat").read_text().rpartition(")")[2].split()[0] in "Tt"
        except (OSError, IndexError):
            return False

    def start(self) -> None:
        """Start a process.

        Call it in the thread of the event loop: a worker is killed when the thread that started it ends.
        """
        self.processes += 1
        context = multiprocessing.get_context("spawn")
        self._reports, sender = context.Pipe(duplex=False)
        self._pool = ProcessPool(
            max_workers=1,
            initializer=begin,
            initargs=(sender, os.getpid(), self._memory_bytes),
            context=context,
        )
        loop = asyncio.get_running_loop()
        self._death, self._pid, self._killed = loop.create_future(), None, False
        self.end_reason = "died"
        with _environment(_WORKER_ENVIRONMENT), _nothing_to_import():
            self._pool.schedule(os.getpid)  # a pool starts its process with its first task
        # With this end closed here, the worker's death ends the stream, and pebble cannot start another.
        sender.close()
        loop.add_reader(self._reports.fileno(), self._receive)

    async def run(
        self,
        function: Callable[..., Returned],
        *arguments: Any,
        deadline_s: float,
        on_report: ReportHandler | None = None,
    ) -> Returned:
        """Run ``function(*arguments)`` in the process; one call at a time.

        Args:
            function: A function of an importable module.
            arguments: What can be pickled.
            deadline_s: After this time the process is killed, also inside compiled code.
            on_report: Called with every report of the call's progress.

        Raises:
            WorkerDied: The process ended.
            DeadlineExceeded: The deadline passed.
            Exception: Whatever the function raises.
        """
        assert self._pool is not None  # a slot is started before it is used
        assert self._death is not None
        self._call += 1
        self._on_report = on_report
        try:
            task = self._pool.schedule(execute, (self._call, function, arguments))
        except RuntimeError as error:  # pebble has seen the death before us
            raise WorkerDied("The worker process ended before the call.") from error
        answer = asyncio.wrap_future(task)
        try:
            await asyncio.wait({answer, self._death}, timeout=deadline_s, return_when=asyncio.FIRST_COMPLETED)
            if answer.done():
                result: Returned = answer.result()
                return result
            if self._death.done():
                raise WorkerDied("The worker process ended.")
            self.kill()
            raise DeadlineExceeded(f"It took longer than {deadline_s:g} s.")
        except (BrokenProcessPool, ProcessExpired) as error:  # pebble has seen the death before us
            raise WorkerDied("The worker process ended.") from error
        except asyncio.CancelledError:
            self.kill()
            raise
        finally:
            self._on_report = None
            if not answer.done():
                _forget(answer)

    async def death(self) -> None:
        """Wait until the process has ended."""
        assert self._death is not None
        await asyncio.shield(self._death)

    def kill(self, reason: EndReason = "killed") -> None:
        """End the process at once, whatever it does."""
        if self.usable and self._pid is not None:
            os.kill(self._pid, signal.SIGKILL)
            self.end_reason = reason
        self._killed = True

    async def discard(self) -> None:
        """End the process, if it still runs, and its pool."""
        self.kill()
        self._close_reports()
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.stop()
            await asyncio.to_thread(pool.join)

    def _receive(self) -> None:
        """Take what the worker sent; the end of the stream is its death."""
        assert self._reports is not None
        try:
            message = self._reports.recv()
        except (EOFError, OSError):
            self._close_reports()
            return
        if isinstance(message, Started):
            self._pid = message.pid
        elif self._on_report is not None and message.call == self._call:  # not a late one of the call before
            self._on_report(message)

    def _close_reports(self) -> None:
        if self._reports is not None:
            asyncio.get_running_loop().remove_reader(self._reports.fileno())
            self._reports.close()
            self._reports = None
        if self._death is not None and not self._death.done():
            self._death.set_result(None)


def _forget(answer: "asyncio.Future[Any]") -> None:
    """Let go of an answer that nobody waits for, without a complaint about its exception."""
    answer.add_done_callback(lambda done: done.cancelled() or done.exception())


@contextmanager
def _nothing_to_import() -> Iterator[None]:
    """Keep the processes started inside from importing the program, which they do not need: it is large."""
    program = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = program


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    """Set variables for the processes started inside; numeric libraries read them when they are loaded."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
