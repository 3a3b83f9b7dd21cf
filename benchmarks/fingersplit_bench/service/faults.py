"""Workers and the whole service are killed at random moments; every accepted job ends right, once."""

import asyncio
import os
import random
import signal
import time
from contextlib import suppress

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile
from fingersplit_client import ApiError, Client, JobCreate, ServiceUnreachable

__all__ = ["measure_cancel", "measure_delay", "survive_kills"]

_BUSY = 4096  # starts of a job that keeps compiled code busy for long


def survive_kills(server: Server, object_id: str, jobs: int, kills: int, seed: int) -> dict[str, float]:
    """Queue jobs; meanwhile kill workers, and every third time the service, and start it again."""
    chance = random.Random(seed)
    accepted: dict[str, int] = {}
    restarts = 0
    with Client(server.url) as client:
        for number in range(jobs):
            request = JobCreate(object_id=object_id, starts=4, seed=number, top_k=1)
            while number not in accepted.values():
                with suppress(ServiceUnreachable, ApiError):
                    accepted[client.create_job(request, idempotency_key=f"kill-{number}").id] = number
            if number % max(1, jobs // kills) == 0:
                time.sleep(chance.uniform(0, 0.3))
                if number // max(1, jobs // kills) % 3 == 2:
                    restarts += 1
                    server.kill()
                    server.start()
                elif workers := server.workers():
                    with suppress(ProcessLookupError):
                        os.kill(chance.choice(workers), signal.SIGKILL)
        wrong, guilty = 0, 0
        for job_id, number in accepted.items():
            job = client.get_job(job_id, wait=25)
            while job.state in ("queued", "running"):
                job = client.get_job(job_id, wait=25)
            guilty += job.error is not None and job.error.code == "worker_died"
            right = job.state == "succeeded" and job.result is not None and job.result.seed == number
            wrong += not right and job.error is None
        listed, cursor = 0, None
        while True:
            page = client.list_jobs(limit=1000, cursor=cursor, object_id=object_id)
            listed += len(page.items)
            cursor = page.next_cursor
            if cursor is None:
                break
    return {
        "accepted": len(accepted),
        "listed": listed,
        "wrong": wrong,
        "failed_after_two_kills": guilty,
        "service_kills": restarts,
    }


def measure_cancel(server: Server, object_id: str, repeats: int) -> dict[str, float]:
    """From the request to cancel a job in compiled code until its process is gone [ms]."""
    times = []
    with Client(server.url) as client:
        for _ in range(repeats):
            job = client.create_job(JobCreate(object_id=object_id, starts=_BUSY))
            while client.get_job(job.id).stage not in ("mapping", "splitting"):
                time.sleep(0.02)
            time.sleep(0.1)
            before = set(server.workers())
            began = time.monotonic()
            client.cancel_job(job.id)
            while before <= set(server.workers()):
                time.sleep(0.001)
            times.append(1e3 * (time.monotonic() - began))
    return {"p50_ms": percentile(times, 50), "largest_ms": max(times)}


def measure_delay(server: Server, object_id: str, repeats: int) -> dict[str, float]:
    """How much longer short jobs take while jobs of the other worker are cancelled all the time [ms]."""
    return asyncio.run(_measure_delay(server, object_id, repeats))


async def _measure_delay(server: Server, object_id: str, repeats: int) -> dict[str, float]:
    def latencies(disturb: bool) -> list[float]:
        found = []
        with Client(server.url) as client, Client(server.url) as other:
            for turn in range(repeats):
                victim = None
                if disturb and turn % 5 == 0:
                    victim = other.create_job(JobCreate(object_id=object_id, starts=_BUSY, priority=1))
                    time.sleep(0.05)
                    other.cancel_job(victim.id)
                began = time.perf_counter()
                client.create_job(JobCreate(object_id=object_id, starts=1, seed=1, recording=False), wait=60)
                found.append(1e3 * (time.perf_counter() - began))
        return found

    calm = await asyncio.to_thread(latencies, False)
    disturbed = await asyncio.to_thread(latencies, True)
    return {"delay_p99_ms": percentile(disturbed, 99) - percentile(calm, 50), "calm_p50_ms": percentile(calm, 50)}
