"""How much jobs on one worker feel of it when the job of the other one is killed in compiled code."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import cycle, islice
from pathlib import Path
from threading import Event

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile
from fingersplit_client import Client, Job, JobCreate

__all__ = ["measure_delay"]

_BUSY = 4096  # starts of a job that keeps compiled code busy for seconds
_DEADLINE = 1.0  # of such a job that is to overrun it [s]
_LOOK = 0.2  # how long processor times are compared to tell which worker is busy [s]

Kill = Callable[[Server, Client, Job], None]


def measure_delay(server: Server, object_id: str, calm_jobs: int, kills: int) -> dict[str, float]:
    """How much longer short jobs take between a kill on the other worker and the end of its replacement [ms].

    Each kill waits until all workers are there again, the spare one too. They are cancels, deadlines and SIGKILLs in
    turn.
    """
    with Client(server.url) as client, ThreadPoolExecutor(1) as pool:
        calm = list(islice(_short_jobs(client, object_id), calm_jobs))
        delays: dict[str, list[float]] = {name: [] for name in _WAYS}
        for _, name in zip(range(kills), cycle(_WAYS), strict=False):
            _wait_for(server.complete)
            request = JobCreate(object_id=object_id, starts=_BUSY, deadline_s=_DEADLINE if name == "deadline" else None)
            busy = client.jobs.create(request)
            while client.jobs.get(busy.id).stage in (None, "starting", "preparing", "parallel_grasps"):
                time.sleep(0.01)
            over = Event()
            meanwhile = pool.submit(_until, over, server.url, object_id)
            _WAYS[name](server, client, busy)
            _wait_for(lambda: not server.complete())
            _wait_for(server.complete)
            over.set()
            delays[name] += [latency - percentile(calm, 50) for latency in meanwhile.result()]
            client.jobs.cancel(busy.id)
    everything = [delay for one in delays.values() for delay in one]
    figures = {f"{name}_p99_ms": percentile(found, 99) for name, found in delays.items() if found}
    return figures | {
        "p99_ms": percentile(everything, 99),
        "p50_ms": percentile(everything, 50),
        "calm_p50_ms": percentile(calm, 50),
        "calm_p99_ms": percentile(calm, 99) - percentile(calm, 50),
        "jobs": len(everything),
    }


def _short_jobs(client: Client, object_id: str) -> Iterator[float]:
    """Latencies of one short job after the other [ms]."""
    request = JobCreate(object_id=object_id, starts=1, seed=1, recording=False)
    for _ in range(3):
        client.jobs.create(request, wait=60)
    while True:
        began = time.perf_counter()
        client.jobs.create(request, wait=60)
        yield 1e3 * (time.perf_counter() - began)


def _until(over: Event, url: str, object_id: str) -> list[float]:
    found = []
    with Client(url) as client:
        for latency in _short_jobs(client, object_id):
            found.append(latency)
            if over.is_set():
                return found
    raise AssertionError("short jobs have no end")


def _cancel(_server: Server, client: Client, job: Job) -> None:
    client.jobs.cancel(job.id)


def _exceed_deadline(_server: Server, client: Client, job: Job) -> None:
    while client.jobs.get(job.id, wait=_DEADLINE).state == "running":
        pass


def _kill(server: Server, _client: Client, _job: Job) -> None:
    before = {pid: _processor_time(pid) for pid in server.workers()}
    time.sleep(_LOOK)
    os.kill(max(before, key=lambda pid: _processor_time(pid) - before[pid]), signal.SIGKILL)


_WAYS: dict[str, Kill] = {"cancel": _cancel, "deadline": _exceed_deadline, "kill": _kill}


def _processor_time(pid: int) -> int:
    """Ticks that a process has spent in its own code."""
    return int((Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[11])


def _wait_for(condition: Callable[[], bool], seconds: float = 120) -> None:
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the service did not come to rest")
        time.sleep(0.01)
