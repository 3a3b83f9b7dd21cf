"""The main job end to end: start the service, upload a mug, plan grasps through the Python client, look at the best.

Run with ``make demo``. Everything it writes goes to ``build/demo``.
"""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich import box
from rich.console import Console
from rich.status import Status
from rich.table import Table

from fingersplit_client import Client, JobSummary, PlanResult

REPOSITORY = Path(__file__).parent.parent
MUG = REPOSITORY / "examples" / "objects" / "mug.ply"
OUTPUT = REPOSITORY / "build" / "demo"
READY_WITHIN = 300.0
"""[s]; the first start on a machine compiles the kernels."""


def main() -> None:
    """Plan grasps for the mug and draw the best one."""
    console = Console()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    with _service(console) as client:
        console.print(f"Uploading {MUG.relative_to(REPOSITORY)}")
        with console.status("planning") as status:
            result = client.plan(MUG, starts=64, seed=1, verified=1, on_progress=lambda job: _show(status, job))
        picture = OUTPUT / "mug.png"
        picture.write_bytes(result.picture())
    result.save(OUTPUT / "mug.json")
    console.print(_table(result))
    console.print(_verdict(result))
    console.print(f"Result:  {(OUTPUT / 'mug.json').relative_to(REPOSITORY)}")
    console.print(f"Picture: {picture.relative_to(REPOSITORY)} (best grasp: start, end, and how quality rose)")


@contextmanager
def _service(console: Console) -> Iterator[Client]:
    """A service of our own on a free port, ended afterwards."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [str(Path(sys.executable).with_name("fingersplit")), "serve"]
    command += ["--port", str(port), "--data-dir", str(OUTPUT / "data")]
    with (OUTPUT / "service.log").open("w") as log:
        service = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
    try:
        with Client(f"http://127.0.0.1:{port}") as client:
            with console.status("starting the service and warming its workers"):
                _wait_until_ready(client, service)
            console.print(f"The service listens on http://127.0.0.1:{port}")
            yield client
    finally:
        service.terminate()
        service.wait(timeout=30)


def _wait_until_ready(client: Client, service: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + READY_WITHIN
    while time.monotonic() < deadline:
        if service.poll() is not None:
            sys.exit(f"The service ended early; its log is {OUTPUT / 'service.log'}.")
        if client.ready(timeout=1):
            return
    sys.exit(f"The service was not ready within {READY_WITHIN:g} s; its log is {OUTPUT / 'service.log'}.")


def _show(status: Status, job: JobSummary) -> None:
    status.update(f"planning: {job.stage or job.state} {job.progress:.0%}")


def _verdict(result: PlanResult) -> str:
    """What the simulation of the ranked grasps showed."""
    for grasp in result.select(verified=True):
        if grasp.verification is not None:
            return f"Lifted in simulation: the grasp of rank {grasp.rank} held. {grasp.verification.explanation}"
    return "Lifted in simulation: no grasp held."


def _table(result: PlanResult) -> Table:
    caption = f"{result.summary.message} {result.timings_ms.total:.0f} ms in the planner."
    table = Table(title=f"Grasps of the {result.object.name}, {result.hand} hand", caption=caption, box=box.SIMPLE_HEAD)
    for heading in ("rank", "feasible", "Ferrari-Canny", "Q", "palm (mm)", "CPO/PPO"):
        table.add_column(heading, justify="right", no_wrap=True)
    for grasp in result.grasps:
        table.add_row(
            str(grasp.rank),
            "yes" if grasp.feasible else "no",
            f"{grasp.metrics.ferrari_canny:.3f}",
            f"{grasp.metrics.quality:.5f}",
            " ".join(f"{1e3 * x:4.0f}" for x in grasp.palm.position),
            f"{grasp.iterations.cpo}/{grasp.iterations.ppo}",
        )
    return table


if __name__ == "__main__":
    main()
