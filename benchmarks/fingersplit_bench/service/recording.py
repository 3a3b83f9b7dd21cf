"""How much later a job's answer is because its run is recorded, and how soon there is something to see."""

import time
from statistics import median
from typing import Any

import httpx2

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile

__all__ = ["measure_recording"]

_WARM_UP = 3
_LONGEST_WAIT = 60.0  # for a picture that is drawn in advance [s]


def measure_recording(server: Server, object_id: str, repeats: int) -> dict[str, float]:
    """Create and wait with and without a recording, in turns [ms]; then the first request of a run's views [ms].

    ``later_p50_ms`` is the median difference between the two jobs of a turn, and ``wait_for_picture_ms`` the time from
    an answer to a small picture that nobody had asked for.
    """
    answers: dict[bool, list[float]] = {True: [], False: []}
    with server.http() as http:
        for turn in range(repeats + _WARM_UP):
            for recorded in (True, False) if turn % 2 else (False, True):
                began = time.perf_counter()
                job = _plan(http, object_id, recorded)
                if turn >= _WARM_UP:
                    answers[recorded].append(1e3 * (time.perf_counter() - began))
        later = [on - off for on, off in zip(answers[True], answers[False], strict=True)]
        job = _plan(http, object_id, True)
        ended = time.perf_counter()
        while not server.has_file(job["id"], "*-thumbnail.webp") and time.perf_counter() < ended + _LONGEST_WAIT:
            time.sleep(0.01)
        drawn = 1e3 * (time.perf_counter() - ended)
        views = {name: _first_request(http, object_id, name) for name in ("recording.rrd", "thumbnail.webp")}
    return {
        "on_p50_ms": percentile(answers[True], 50),
        "off_p50_ms": percentile(answers[False], 50),
        "later_p50_ms": median(later),
        "wait_for_picture_ms": drawn,
        **{f"{name.partition('.')[0]}_first_request_ms": value for name, value in views.items()},
    }


def _plan(http: httpx2.Client, object_id: str, recorded: bool) -> dict[str, Any]:
    body = {"object_id": object_id, "starts": 64, "seed": 1, "recording": recorded}
    job: dict[str, Any] = http.post("/v1/jobs", json=body, headers={"Prefer": "wait=120"}).json()
    return job


def _first_request(http: httpx2.Client, object_id: str, name: str, repeats: int = 5) -> float:
    """Median time until a view of a run that just ended is there, by a worker that made one before [ms]."""
    times = []
    for _ in range(repeats + 2):  # the first of each worker loads what draws
        job = _plan(http, object_id, True)
        began = time.perf_counter()
        http.get(f"/v1/jobs/{job['id']}/{name}").raise_for_status()
        times.append(1e3 * (time.perf_counter() - began))
    return median(times[2:])
