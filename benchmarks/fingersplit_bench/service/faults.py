"""Workers and the whole service are killed at random moments; every accepted job ends right, once."""

import os
import random
import signal
import time
from contextlib import suppress

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile
from fingersplit_client import ApiError, Client, JobCreate, ServiceUnreachable

__all__ = ["measure_cancel", "survive_kills"]

_BUSY = 4096  # starts of a job that keeps compiled code busy for long


def survive_kills(server: Server, object_id: str, jobs: int, kills: int, seed: int) -> dict[str, float]:
    """Queue jobs; meanwhile kill workers, and every third time the service, and start it again.

    ``wrong`` counts jobs that did not end with the result that was asked for, unless they may not: one whose workers
    were killed twice is given up by design.
    """
    chance = random.Random(seed)
    accepted: dict[str, int] = {}
    restarts = 0
    with Client(server.url) as client:
        before = _listed(client, object_id)
        for number in range(jobs):
            request = JobCreate(object_id=object_id, starts=4, seed=number, top_k=1)
            while number not in accepted.values():
                with suppress(ServiceUnreachable, ApiError):
                    accepted[client.jobs.create(request, idempotency_key=f"kill-{number}").id] = number
            if number % max(1, jobs // kills) == 0:
                time.sleep(chance.uniform(0, 0.3))
                if number // max(1, jobs // kills) % 3 == 2:
                    restarts += 1
                    server.kill()
                    server.start()
                elif workers := server.workers():
                    with suppress(ProcessLookupError):
                        os.kill(chance.choice(workers), signal.SIGKILL)
        wrong, total = 0, 0
        for job_id, number in accepted.items():
            job = client.jobs.get(job_id, wait=25)
            while job.state in ("queued", "running"):
                job = client.jobs.get(job_id, wait=25)
            given_up = job.error is not None and job.error.code == "worker_died" and job.attempts > 1
            right = job.state == "succeeded" and job.result is not None and job.result.seed == number
            total += given_up
            wrong += not right and not given_up
        listed = _listed(client, object_id) - before
    return {
        "accepted": len(accepted),
        "lost": len(accepted.keys() - listed),
        "twice": len(listed - accepted.keys()),
        "wrong": wrong,
        "given_up_after_two_kills": total,
        "service_kills": restarts,
    }


def _listed(client: Client, object_id: str) -> set[str]:
    """Ids of all jobs of an object."""
    return {job.id for job in client.jobs.all(object_id=object_id)}


def measure_cancel(server: Server, object_id: str, repeats: int) -> dict[str, float]:
    """From the request to cancel a job in compiled code until its process is gone [ms]."""
    times = []
    with Client(server.url) as client:
        for _ in range(repeats):
            job = client.jobs.create(JobCreate(object_id=object_id, starts=_BUSY))
            while client.jobs.get(job.id).stage not in ("mapping", "splitting"):
                time.sleep(0.02)
            time.sleep(0.1)
            before = set(server.workers())
            began = time.monotonic()
            client.jobs.cancel(job.id)
            while before <= set(server.workers()):
                time.sleep(0.001)
            times.append(1e3 * (time.monotonic() - began))
    return {"p50_ms": percentile(times, 50), "largest_ms": max(times)}
