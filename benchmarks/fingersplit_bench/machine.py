"""What the figures were measured on."""

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

__all__ = ["describe_machine", "on_core"]

PACKAGES = ("fingersplit", "numpy", "numba", "scipy", "mujoco", "casadi", "drake")


def describe_machine() -> dict[str, Any]:
    """Processor, cores, load, operating system and versions, as plain JSON data."""
    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "load_average": round(os.getloadavg()[0], 2),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": {package: _version(package) for package in PACKAGES},
    }


def _cpu_model() -> str:
    """Name and numbers of the processor, as far as the system tells them."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    facts = {name.strip(): fact.strip() for name, _, fact in (line.partition(":") for line in lines)}
    name = facts.get("model name") or platform.processor() or "unknown"
    numbers = [f"{key} {facts[full]}" for key, full in (("family", "cpu family"), ("model", "model")) if full in facts]
    return ", ".join([name, *numbers])


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


@contextmanager
def on_core(number: int) -> Iterator[None]:
    """Keep the calling thread on one of the cores it may use, counted round, where the system offers that."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {sorted(allowed)[number % len(allowed)]})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)
