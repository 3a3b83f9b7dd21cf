"""How long one client waits for a plan of a warm object, and how much of that is not planning."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgpack

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile
from fingersplit_client import Client

__all__ = ["measure_latency", "measure_list", "measure_plan"]


def measure_latency(server: Server, object_id: str, repeats: int, **options: object) -> dict[str, float]:
    """Create and wait, again and again [ms]."""
    body = {"object_id": object_id, "starts": 64, "seed": 1} | options
    latencies, others = [], []
    with server.http() as http:
        for turn in range(repeats + 3):
            began = time.perf_counter()
            response = http.post("/v1/jobs", json=body, headers={"Prefer": "wait=120"})
            latency = 1e3 * (time.perf_counter() - began)
            result: dict[str, Any] = response.json()["result"]
            if turn >= 3:  # the first ones make the object warm
                latencies.append(latency)
                others.append(latency - result["timings_ms"]["total"])
    return {
        "p50_ms": percentile(latencies, 50),
        "p95_ms": percentile(latencies, 95),
        "not_planning_p50_ms": percentile(others, 50),
    }


def measure_plan(server: Server, object_id: str, mesh: Path, repeats: int) -> dict[str, float]:
    """One blocking call, best of 64, object known: raw as JSON and as MessagePack, and by the client [ms].

    What the client's call takes longer than a raw one is told of calls that do nothing but answer.
    """
    body = {"object_id": object_id, "starts": 64, "top_k": 1, "seed": 1, "recording": False, "verify_first": False}
    packed = {"Content-Type": "application/msgpack", "Accept": "application/msgpack"}
    content = msgpack.packb(body)
    with server.http() as http, Client(server.url) as client:

        def call() -> None:
            client.plan(mesh, starts=64, top_k=1, seed=1, recording=False, verify_first=False)

        raw = _times(lambda: http.post("/v1/plan", json=body), repeats)
        binary = _times(lambda: http.post("/v1/plan", content=content, headers=packed), repeats)
        whole = _times(call, repeats)
        answers = _times(lambda: http.get(f"/v1/objects/{object_id}").json(), repeats)
        through = _times(lambda: client.objects.get(object_id), repeats)
    return {
        "plan_p50_ms": percentile(raw, 50),
        "plan_p99_ms": percentile(raw, 99),
        "msgpack_p50_ms": percentile(binary, 50),
        "msgpack_p99_ms": percentile(binary, 99),
        "client_p50_ms": percentile(whole, 50),
        "client_p99_ms": percentile(whole, 99),
        "overhead_a_call_p50_ms": percentile(through, 50) - percentile(answers, 50),
    }


def _times(call: Callable[[], Any], repeats: int) -> list[float]:
    """Times of calls, after three that make everything warm [ms]."""
    times = []
    for _ in range(repeats + 3):
        began = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - began))
    return times[3:]


def measure_list(server: Server, repeats: int = 20) -> dict[str, float]:
    """Time of the first page of a thousand jobs, and of reading every page [ms]."""
    first, whole, count = [], [], 0
    with server.http() as http:
        for _ in range(repeats):
            began, cursor, count = time.perf_counter(), None, 0
            while True:
                query = {"limit": "1000"} | ({"cursor": cursor} if cursor else {})
                page = json.loads(http.get("/v1/jobs", params=query).content)
                count += len(page["items"])
                if cursor is None:
                    first.append(1e3 * (time.perf_counter() - began))
                cursor = page["next_cursor"]
                if cursor is None:
                    break
            whole.append(1e3 * (time.perf_counter() - began))
    return {"jobs": count, "page_of_1000_p50_ms": percentile(first, 50), "all_pages_p50_ms": percentile(whole, 50)}
