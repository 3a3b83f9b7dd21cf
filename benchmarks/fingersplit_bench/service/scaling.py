"""How several machines scale: a discrete-event model fed by measured times, and measured points beside it.

Jobs arrive at random, pass a replica, wait in the table, are claimed by a free worker of an agent and written back. A
replica's core, the database and the workers are what they wait for.
"""

import random
import time
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any

import httpx2

from fingersplit_bench.service.cluster import upload_cube, wait_for
from fingersplit_bench.service.machines import Machines
from fingersplit_bench.service.statistics import percentile

__all__ = ["Fleet", "Outcome", "Times", "measure_scaling", "simulate", "table"]

_BATCH = 100
_HOLD_MS = 50  # of a job of a measured point


@dataclass(frozen=True)
class Times:
    """What one job takes of each part [s].

    Attributes:
        accept: Core of a replica: the request, and the answer with the result.
        database: PostgreSQL, for accepting, claiming and ending it.
        handling: Worker's slot beside planning: claim, calls, writing the end.
        plan: Core of a worker: planning.
        verify: Core of a worker: simulations until one grasp has held.
        spread: Standard deviation of planning and verifying, as a share of their mean.
    """

    accept: float = 0.004
    database: float = 0.002
    handling: float = 0.006
    plan: float = 0.070
    verify: float = 0.077
    spread: float = 0.4


@dataclass(frozen=True)
class Fleet:
    """Machines: replicas with a core each, and agents with as many worker processes as cores."""

    replicas: int = 2
    agents: int = 2
    workers: int = 4


@dataclass(frozen=True)
class Outcome:
    """What a simulated service did.

    Attributes:
        per_second: Jobs ended a second.
        p50: Median time from the request to the result [s].
        p95: Time that 95 percent do not exceed [s].
        busy: Share of the time that each part was busy: ``replicas``, ``database``, ``workers``.
    """

    per_second: float
    p50: float
    p95: float
    busy: dict[str, float]

    @property
    def saturated(self) -> str:
        """The part that is busiest."""
        return max(self.busy, key=lambda part: self.busy[part])


def simulate(times: Times, fleet: Fleet, arrivals: float, jobs: int = 4000, seed: int = 1) -> Outcome:
    """Run the model.

    Args:
        times: What a job takes.
        fleet: The machines.
        arrivals: Jobs a second that are asked for.
        jobs: How many.
        seed: Of the random times.
    """
    import simpy  # of the group bench

    chance, world = random.Random(seed), simpy.Environment()
    sizes = {"replicas": fleet.replicas, "database": 1, "workers": fleet.agents * fleet.workers}
    parts = {name: simpy.Resource(world, size) for name, size in sizes.items()}
    used, latencies = dict.fromkeys(sizes, 0.0), list[float]()

    def take(name: str, seconds: float) -> Generator[Any, Any, None]:
        with parts[name].request() as turn:
            yield turn
            used[name] += seconds
            yield world.timeout(seconds)

    def job() -> Generator[Any, Any, None]:
        began = world.now
        yield from take("replicas", times.accept / 2)
        yield from take("database", times.database / 3)
        with parts["workers"].request() as turn:
            yield turn
            claimed = world.now
            yield from take("database", times.database / 3)
            mean = times.plan + times.verify
            work = chance.gammavariate(1 / times.spread**2, mean * times.spread**2) if times.spread else mean
            yield world.timeout(work + times.handling)
            yield from take("database", times.database / 3)
            used["workers"] += world.now - claimed
        yield from take("replicas", times.accept / 2)
        latencies.append(world.now - began)

    def source() -> Generator[Any, Any, None]:
        for _ in range(jobs):
            world.process(job())
            yield world.timeout(chance.expovariate(arrivals))

    world.process(source())
    world.run()
    busy = {name: used[name] / (world.now * size) for name, size in sizes.items()}
    return Outcome(jobs / world.now, percentile(latencies, 50), percentile(latencies, 95), busy)


def measure_scaling(jobs: int) -> dict[str, float]:
    """Jobs of 50 ms a second with one and with two agents of two workers, beside what the model says of them.

    The model's time for handling is what one agent shows; the second point is its prediction.
    """
    measured = {agents: _measured(agents, jobs) for agents in (1, 2)}
    hold = _HOLD_MS / 1e3
    handling = max(0.0, 2 / measured[1] - hold)
    times = Times(plan=hold, verify=0.0, handling=handling, spread=0.0)
    found = {f"measured_{agents}_agents": value for agents, value in measured.items()}
    for agents in (1, 2):
        fleet = Fleet(replicas=1, agents=agents, workers=2)
        found[f"model_{agents}_agents"] = simulate(times, fleet, 1e4, jobs).per_second
    return found | {"handling_ms": 1e3 * handling}


def _measured(agents: int, jobs: int) -> float:
    with Machines(1, agents, 2) as machines, httpx2.Client(base_url=machines.replicas[0].url, timeout=120) as http:
        body = {"object_id": upload_cube(http), "starts": _HOLD_MS}
        began = time.perf_counter()
        batches = [
            http.post("/v1/batches", json={"jobs": [body] * _BATCH}).raise_for_status().json()["id"]
            for _ in range(jobs // _BATCH)
        ]
        wait_for(http, batches)
        return len(batches) * _BATCH / (time.perf_counter() - began)


def table(times: Times, load: float = 0.9) -> str:
    """Machines against jobs a second and latency, as Markdown; ``load`` is the share of what the workers could do."""
    lines = ["| agents (4 workers) | replicas | jobs/s | p50 [s] | p95 [s] | busiest |", "|---|---|---|---|---|---|"]
    for agents in (1, 2, 4, 8, 16, 32):
        for replicas in sorted({2, max(2, agents // 4)}):
            fleet = Fleet(replicas, agents)
            most = agents * fleet.workers / (times.plan + times.verify + times.handling)
            found = simulate(times, fleet, load * most)
            share = f"{found.saturated} {found.busy[found.saturated]:.0%}"
            row = (agents, replicas, f"{found.per_second:.0f}", f"{found.p50:.2f}", f"{found.p95:.2f}", share)
            lines.append("| " + " | ".join(map(str, row)) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(Times()))
    print(table(replace(Times(), verify=0.0)))
