"""What runs in a worker process around each call: limits on itself, and reports of progress.

Importing this module imports nothing numeric: a worker limits itself before it loads the planner.
"""

import ctypes
import os
import resource
import signal
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, TypeVar

__all__ = ["Report", "Started", "begin", "execute", "report_progress", "run_niced"]

Returned = TypeVar("Returned")

_PR_SET_PDEATHSIG = 1
_REPORT_INTERVAL = 0.05  # [s]
_LOWEST = 19  # niceness
_BUSY = 2.0  # processes that want to run, for each core, from which on idle ones would hardly ever get it
_ALLOCATOR_RESERVE = "65536"  # [KiB]; else rerun and arrow each take 1 GiB of the address space when they are loaded


@dataclass(frozen=True)
class Started:
    """First message of a worker: its process id."""

    pid: int


@dataclass(frozen=True)
class Report:
    """How far a call is: its number, what it is doing, and the share of the work done."""

    call: int
    stage: str
    progress: float


@dataclass
class _Reporter:
    """Where this process reports to, and what it reported last."""

    connection: Connection | None = None
    call: int = 0
    stage: str = ""
    next_time: float = 0.0


_reporter = _Reporter()


def begin(connection: Connection, parent: int, memory_bytes: int) -> None:
    """Set up a new worker process.

    Args:
        connection: Where reports go. Only this process holds the end, so it breaks when the process dies.
        parent: Process id of the service; the worker ends with it.
        memory_bytes: Largest address space.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before the line above
        os._exit(1)
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    os.environ.setdefault("MIMALLOC_ARENA_RESERVE", _ALLOCATOR_RESERVE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _reporter.connection = connection
    try:
        connection.send(Started(os.getpid()))
    except BrokenPipeError:  # the service has given this process up already
        os._exit(1)


def execute(call: int, function: Callable[..., Returned], arguments: tuple[Any, ...]) -> Returned:
    """Run one call; what it reports carries its number."""
    _reporter.call, _reporter.stage, _reporter.next_time = call, "", 0.0
    return function(*arguments)


def run_niced(niceness: int, function: Callable[..., Returned], *arguments: Any) -> Returned:
    """Run a function at a lower priority of the operating system, 19 is the lowest.

    At 19 it gets what idle cores leave, unless the machine is too busy for that to ever happen. It runs in a thread of
    its own: Linux has a priority for each thread, and a process cannot raise its own again.
    """
    with ThreadPoolExecutor(1, initializer=_lower_priority, initargs=(niceness,)) as pool:
        return pool.submit(function, *arguments).result()


def _lower_priority(niceness: int) -> None:
    if sys.platform == "linux":
        thread = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, thread, max(niceness, os.getpriority(os.PRIO_PROCESS, thread)))
        if niceness == _LOWEST and os.getloadavg()[0] < _BUSY * (os.cpu_count() or 1):
            # A core that runs nothing else then counts as idle when a thread of a job looks for one.
            os.sched_setscheduler(thread, os.SCHED_IDLE, os.sched_param(0))


def report_progress(stage: str, progress: float) -> None:
    """Tell the service how far this call is; too frequent reports of one stage are dropped."""
    now = time.monotonic()
    if _reporter.connection is None or (stage == _reporter.stage and now < _reporter.next_time):
        return
    _reporter.stage, _reporter.next_time = stage, now + _REPORT_INTERVAL
    _reporter.connection.send(Report(_reporter.call, stage, min(max(progress, 0.0), 1.0)))
