"""What several machines cost and give, with jobs that do nothing: latency, jobs a second, warm objects, fair shares."""

import json
import random
import signal
import time
from collections.abc import Callable
from datetime import datetime
from typing import Any

import httpx2

from fingersplit_bench.service.machines import Machine, Machines
from fingersplit_bench.service.statistics import percentile

__all__ = ["measure_cluster", "upload_cube", "wait_for"]

_BATCH = 250
_OBJECTS = 20


def measure_cluster(repeats: int, jobs: int) -> dict[str, float]:
    """Figures of two replicas and two agents of two workers each, beside one embedded service."""
    figures = dict[str, float]()
    with _Alone() as alone:
        figures["embedded_p50_ms"] = _round_trip(alone.url, repeats)
    with Machines(2, 2, 2) as machines:
        replica = machines.replicas[0].url
        figures["p50_ms"] = _round_trip(replica, repeats)
        figures["more_ms"] = figures["p50_ms"] - figures["embedded_p50_ms"]
        figures |= _throughput(machines, jobs)
        figures["warm_share"] = _warm_share(replica, jobs // 2)
        figures |= _takeover(machines)
    return figures


class _Alone:
    """An embedded service with jobs that do nothing."""

    def __enter__(self) -> Machine:
        self._machine = Machine("serve", workers=1, spare_workers=0, verify_first="false")
        self._machine.wait_until_ready()
        return self._machine

    def __exit__(self, *_: object) -> None:
        self._machine.kill()


def upload_cube(http: httpx2.Client, edge: float = 0.05) -> str:
    """Upload a cube [m]; its id."""
    corners = [(x, y, z) for z in (0, edge) for x, y in ((0, 0), (edge, 0), (edge, edge), (0, edge))]
    faces = ["021", "032", "456", "467", "015", "054", "126", "165", "237", "276", "304", "347"]
    lines = ["OFF", "8 12 0", *(f"{x} {y} {z}" for x, y, z in corners), *(f"3 {' '.join(face)}" for face in faces)]
    answer = http.post("/v1/objects", files={"file": ("cube.off", "\n".join(lines).encode())}).raise_for_status()
    object_id: str = answer.json()["id"]
    return object_id


def _round_trip(url: str, repeats: int) -> float:
    """Median time from the request to the answer with the result [ms]."""
    times = []
    with httpx2.Client(base_url=url, timeout=120) as http:
        body = {"object_id": upload_cube(http), "starts": 1}
        for _ in range(repeats):
            began = time.perf_counter()
            answer = http.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"})
            assert answer.json()["state"] == "succeeded"
            times.append(1e3 * (time.perf_counter() - began))
    return percentile(times, 50)


def _throughput(machines: Machines, jobs: int) -> dict[str, float]:
    """Jobs accepted in batches and finished in a second, half by either replica."""
    with httpx2.Client(timeout=120) as http:
        urls = [machine.url for machine in machines.replicas]
        http.base_url = httpx2.URL(urls[0])
        body = {"object_id": upload_cube(http), "starts": 1}
        batches = []
        began = time.perf_counter()
        for place in range(jobs // _BATCH):
            answer = http.post(f"{urls[place % 2]}/v1/batches", json={"jobs": [body] * _BATCH}).raise_for_status()
            batches.append(answer.json()["id"])
        accepted = time.perf_counter() - began
        wait_for(http, batches)
        return {
            "accepted_per_second": jobs / accepted,
            "jobs_per_second": jobs / (time.perf_counter() - began),
        }


def wait_for(http: httpx2.Client, batches: list[str]) -> None:
    """Wait until every job of some batches has ended."""
    for one in batches:  # one at a time: asking for all of them takes a good part of a core
        _wait(lambda: _ended(http, one))  # noqa: B023 -- called at once


def _ended(http: httpx2.Client, batch_id: str) -> bool:
    states = http.get(f"/v1/batches/{batch_id}").raise_for_status().json()["states"]
    return not set(states) & {"queued", "running"}


def _warm_share(url: str, jobs: int) -> float:
    """Share of jobs for 20 objects, in random order, that found theirs warm on one of 4 workers."""
    chance = random.Random(1)
    with httpx2.Client(base_url=url, timeout=120) as http:
        objects = [upload_cube(http, 0.03 + 0.001 * place) for place in range(_OBJECTS)]
        ids: list[str] = []
        while len(ids) < jobs:
            wanted = [{"object_id": chance.choice(objects), "starts": 5} for _ in range(_BATCH)]
            ids += http.post("/v1/batches", json={"jobs": wanted}).raise_for_status().json()["job_ids"]
        found = [bool(_result(http, one)["warm"]) for one in ids]
    return sum(found) / len(found)


def _result(http: httpx2.Client, job_id: str) -> Any:
    job = json.loads(http.get(f"/v1/jobs/{job_id}", headers={"Prefer": "wait=120"}).text)
    return job["result"]


def _takeover(machines: Machines) -> dict[str, float]:
    """Time until a job runs again whose agent was killed, and whose agent was stopped [s]."""
    figures = {}
    for name, death in (("killed", signal.SIGKILL), ("stopped", signal.SIGSTOP)):
        with httpx2.Client(base_url=machines.replicas[0].url, timeout=120) as http:
            body = {"object_id": upload_cube(http), "starts": 4000}
            jobs = [http.post("/v1/jobs", json=body).json()["id"] for _ in range(4)]
            _wait(lambda: all(_job(http, one)["state"] == "running" for one in jobs))  # noqa: B023 -- called at once
            time.sleep(0.5)
            began = time.time()
            machines.agents[0].process.send_signal(death)
            if death == signal.SIGKILL:
                machines.agents[0].kill()
            ended = [json.loads(http.get(f"/v1/jobs/{one}", headers={"Prefer": "wait=120"}).text) for one in jobs]
            again = [job for job in ended if job["attempts"] > 1]
            # A free worker takes it up: the other agent's two are busy for up to 4 s.
            figures[f"{name}_jobs_again"] = float(len(again))
            queue = [_queued_again(http, job["id"], began) for job in again]
            figures[f"{name}_done_again_s"] = max(queue, default=0.0)
            if death == signal.SIGKILL:
                machines.agents[0].start()
                machines.agents[0].wait_until_ready()
            else:
                machines.agents[0].process.send_signal(signal.SIGCONT)
    return figures


def _queued_again(http: httpx2.Client, job_id: str, began: float) -> float:
    started = datetime.fromisoformat(_job(http, job_id)["started_at"])
    return started.timestamp() - began


def _job(http: httpx2.Client, job_id: str) -> dict[str, Any]:
    found: dict[str, Any] = http.get(f"/v1/jobs/{job_id}").json()
    return found


def _wait(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 300
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("It did not come to an end.")
        time.sleep(0.05)
