"""Measure the service and write ``service.md`` and ``service.json``."""

import argparse
import asyncio
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fingersplit.objects.parametric import cylinder
from fingersplit_bench.service.behind import measure_behind
from fingersplit_bench.service.cluster import measure_cluster
from fingersplit_bench.service.delay import measure_delay
from fingersplit_bench.service.faults import measure_cancel, survive_kills
from fingersplit_bench.service.flood import measure_flood
from fingersplit_bench.service.latency import measure_latency, measure_list, measure_plan
from fingersplit_bench.service.load import jobs_per_second_without_http, measure_load
from fingersplit_bench.service.recording import measure_recording
from fingersplit_bench.service.scaling import measure_scaling
from fingersplit_bench.service.server import Server
from fingersplit_client import Client

__all__ = ["SECTIONS", "main", "measure"]

SECTIONS = (
    "start",
    "latency",
    "plan",
    "recording",
    "cancel",
    "delay",
    "behind",
    "load",
    "kills",
    "list",
    "flood",
    "cluster",
    "scaling",
)


def main() -> None:
    """Measure the chosen sections against a service of their own."""
    parser = argparse.ArgumentParser(prog="python -m fingersplit_bench.service", description=__doc__)
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], help="what to measure; by default everything")
    parser.add_argument("--mesh", type=Path, default=Path("examples/objects/mug.ply"), help="object of the latencies")
    parser.add_argument("--repeats", type=int, default=100, help="requests a latency is measured over")
    parser.add_argument("--jobs", type=int, default=5_000, help="jobs of the load")
    parser.add_argument("--clients", type=int, default=50, help="clients of the load")
    parser.add_argument("--starts", type=int, default=64, help="starts of each job of the load")
    parser.add_argument("--cluster-jobs", type=int, default=2_000, help="jobs of the section cluster")
    parser.add_argument("--kill-jobs", type=int, default=300, help="jobs during which things are killed")
    parser.add_argument("--delay-kills", type=int, default=9, help="kills while a delay is measured")
    parser.add_argument("--default-jobs", type=int, default=500, help="jobs of the section behind")
    parser.add_argument("--report", type=Path, default=Path("build/bench"), help="folder for the report")
    arguments = parser.parse_args()
    sections = list(arguments.sections or SECTIONS)
    figures: dict[str, Any] = {}
    alone = {  # sections with services of their own
        "flood": lambda: measure_flood(arguments.cluster_jobs),
        "cluster": lambda: measure_cluster(arguments.repeats, arguments.cluster_jobs),
        "scaling": lambda: measure_scaling(arguments.cluster_jobs // 4),
    }
    for name, measured in alone.items():
        if name in sections:
            figures[name] = measured()
            _print(name, figures[name])
            sections.remove(name)
    if "start" in sections:  # before anything else runs
        with TemporaryDirectory() as folder, Server(Path(folder), spares=0) as fresh:
            figures["start"] = {"seconds_to_ready": fresh.seconds_to_ready, "memory_mib": fresh.memory()}
    if sections:
        _measure_alone(sections, arguments, figures)
    arguments.report.mkdir(parents=True, exist_ok=True)
    (arguments.report / "service.json").write_text(json.dumps(figures, indent=2) + "\n")
    rows = [f"| {part} | {name} | {value:.4g} |" for part, one in figures.items() for name, value in one.items()]
    (arguments.report / "service.md").write_text(
        "\n".join(["| what | figure | value |", "|---|---|---|", *rows]) + "\n"
    )


def _measure_alone(sections: list[str], arguments: argparse.Namespace, figures: dict[str, Any]) -> None:
    """Figures of sections that one service is enough for."""
    with TemporaryDirectory() as folder, Server(Path(folder)) as server:
        for section in sections:
            if section not in figures:
                figures[section] = measure(section, server, arguments)
            _print(section, figures[section])


def _print(section: str, figures: dict[str, float]) -> None:
    print(f"{section}: " + ", ".join(f"{name} {value:.4g}" for name, value in figures.items()), flush=True)


def measure(section: str, server: Server, arguments: argparse.Namespace) -> dict[str, float]:
    """Figures of one section."""
    with Client(server.url) as client:
        mesh = client.objects.upload(arguments.mesh).id
        can = client.objects.upload(_can(), file_type="off", name="can").id
    server.wait_until_idle()  # the spare worker's start and the objects' convex pieces take a core for seconds
    if section == "latency":
        verified = measure_latency(server, mesh, arguments.repeats, verified=1)  # first: it has the pieces made
        return measure_latency(server, mesh, arguments.repeats) | {
            "verified_" + name: x for name, x in verified.items()
        }
    if section == "plan":
        return measure_plan(server, mesh, arguments.mesh, arguments.repeats)
    if section == "recording":
        return measure_recording(server, mesh, arguments.repeats)
    if section == "cancel":
        return measure_cancel(server, mesh, 10)
    if section == "delay":
        return measure_delay(server, can, arguments.repeats, arguments.delay_kills)
    if section == "behind":
        return measure_behind(server, mesh, arguments.default_jobs)
    if section == "kills":
        return survive_kills(server, can, arguments.kill_jobs, 30, seed=1)
    if section == "list":
        return measure_list(server)
    alone = asyncio.run(jobs_per_second_without_http(2, max(100, arguments.jobs // 10), arguments.starts))
    found = asyncio.run(measure_load(server, can, arguments.clients, arguments.jobs, arguments.starts))
    return found | {"without_http_per_second": alone, "share": found["jobs_per_second"] / alone}


def _can() -> bytes:
    mesh = cylinder()
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.faces)} 0"]
    lines += [" ".join(f"{x:.9g}" for x in vertex) for vertex in mesh.vertices]
    lines += ["3 " + " ".join(str(i) for i in face) for face in mesh.faces]
    return "\n".join(lines).encode()


if __name__ == "__main__":
    main()
