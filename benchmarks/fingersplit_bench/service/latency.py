"""How long one client waits for a plan of a warm object, and how much of that is not planning."""

import json
import time
from typing import Any

from fingersplit_bench.service.server import Server
from fingersplit_bench.service.statistics import percentile

__all__ = ["measure_latency", "measure_list"]


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
