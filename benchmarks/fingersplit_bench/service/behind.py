"""What verifying and recording the first grasp of every run, behind its answer, costs and how soon it is done."""

import os
import random
import signal
import time
from contextlib import suppress

import httpx2

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile

__all__ = ["measure_behind"]

_WITHIN = 60.0  # after the last answer, when runs are counted [s]
_RECORDING = "*recording.rrd"


def measure_behind(server: Server, object_id: str, jobs: int) -> dict[str, float]:
    """Default jobs one after the other, a worker killed meanwhile; as many without it before and after [ms].

    ``complete`` counts the runs that have a verification and a recording a minute after the last answer.
    """
    chance = random.Random(1)
    with server.http() as http:
        without = [_answer(http, object_id, verify=False)[0] for _ in range(jobs // 2)]
        times, ids = [], []
        for number in range(jobs):
            if number == jobs // 2:
                with suppress(ProcessLookupError):
                    os.kill(chance.choice(server.workers()), signal.SIGKILL)
            taken, job_id = _answer(http, object_id, verify=True)
            times.append(taken)
            ids.append(job_id)
        began = time.monotonic()
        complete: set[str] = set()
        while len(complete) < jobs and time.monotonic() < began + _WITHIN:
            complete |= {one for one in ids if one not in complete and _is_complete(server, http, one)}
            time.sleep(0.2)
        taken = time.monotonic() - began
        without += [_answer(http, object_id, verify=False)[0] for _ in range(jobs // 2)]
    return {
        "jobs": jobs,
        "complete": len(complete),
        "complete_after_s": taken,
        "p50_ms": percentile(times, 50),
        "off_p50_ms": percentile(without, 50),
        "ratio": percentile(times, 50) / percentile(without, 50),
    }


def _answer(http: httpx2.Client, object_id: str, *, verify: bool) -> tuple[float, str]:
    """Time from a request to its result [ms], and the job's id."""
    body = {"object_id": object_id} if verify else {"object_id": object_id, "verify_first": False}
    began = time.perf_counter()
    job = http.post("/v1/jobs", json=body, headers={"Prefer": "wait=120"}).raise_for_status().json()
    taken = 1e3 * (time.perf_counter() - began)
    if job["state"] != "succeeded":
        raise RuntimeError(f"Job {job['id']} {job['state']}.")
    return taken, job["id"]


def _is_complete(server: Server, http: httpx2.Client, job_id: str) -> bool:
    """Whether a run is verified and recorded."""
    if not server.has_file(job_id, _RECORDING):
        return False
    return bool(http.get(f"/v1/jobs/{job_id}").raise_for_status().json()["verification"] == "done")
