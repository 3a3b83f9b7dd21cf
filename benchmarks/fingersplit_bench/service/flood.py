"""How long one owner's job waits while another owner has thousands in the queue."""

import os
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

import httpx2

from fingersplit_bench.service.cluster import upload_cube
from fingersplit_bench.service.machines import Machine
from fingersplit_bench.service.statistics import percentile

__all__ = ["measure_flood"]

_BATCH = 250
_JOB_MS = 50  # what each job takes
_REPEATS = 20


def measure_flood(jobs: int) -> dict[str, float]:
    """Waits of single jobs [ms] on one machine of two workers, beside ``jobs`` jobs of another owner.

    ``beyond_a_job_ms`` is the longest wait without the one job that a worker may just have begun.
    """
    machine = Machine("serve", workers=2, spare_workers=0, verify_first="false")
    with httpx2.Client(base_url=machine.url, timeout=120) as one, httpx2.Client(base_url=machine.url) as other:
        try:
            machine.wait_until_ready()
            for http, name in ((one, "floods"), (other, "waits")):
                http.headers["Authorization"] = f"Bearer {_new_key(machine, name)}"
            waits = _waits(one, other, jobs)
        finally:
            machine.kill()
    return {
        "queued": jobs,
        "wait_p50_ms": percentile(waits, 50),
        "longest_wait_ms": max(waits),
        "beyond_a_job_ms": max(waits) - _JOB_MS,
    }


def _waits(one: httpx2.Client, other: httpx2.Client, jobs: int) -> list[float]:
    while one.get("/v1/jobs").status_code == 401:  # until the service knows the new keys
        time.sleep(0.05)
    objects = [upload_cube(http) for http in (one, other)]
    flood = {"object_id": objects[0], "starts": _JOB_MS, "priority": 10}
    for _ in range(jobs // _BATCH):
        one.post("/v1/batches", json={"jobs": [flood] * _BATCH}).raise_for_status()
    waits = []
    for _ in range(_REPEATS):
        body = {"object_id": objects[1], "starts": _JOB_MS}
        job = other.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).raise_for_status().json()
        created, started = (datetime.fromisoformat(job[name]) for name in ("created_at", "started_at"))
        waits.append(1e3 * (started - created).total_seconds())
        time.sleep(0.1)
    return waits


def _new_key(machine: Machine, name: str) -> str:
    """A new key of a machine's data directory."""
    program = str(Path(sys.executable).with_name("fingersplit"))
    environment = os.environ | machine.environment
    return subprocess.check_output([program, "keys", "create", name], env=environment, text=True).strip()
