"""A service with the real planner in a process of its own."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from fingersplit_client import Client

__all__ = ["serving", "unused_port"]

START_WITHIN = 900
"""[s]; with nothing compiled yet it takes minutes."""


@contextmanager
def serving(data_dir: Path, *options: object, environment: Mapping[str, str] | None = None) -> Iterator[str]:
    """The address of a service that is ready; one that ends while it starts is told with what it logged.

    It has no spare worker, unless the environment says so: to start one takes seconds.
    """
    port = unused_port()
    program = Path(sys.executable).with_name("fingersplit")
    command = [program, "serve", "--port", str(port), "--data-dir", data_dir, *map(str, options)]
    surroundings = {"FINGERSPLIT_SPARE_WORKERS": "0", **(environment or os.environ)}
    log = data_dir.with_name(f"{data_dir.name}-{port}.log")
    with log.open("w") as written:
        process = subprocess.Popen(command, env=surroundings, stdout=written, stderr=written)
    url = f"http://127.0.0.1:{port}"
    try:
        _wait_until_ready(process, url, log)
        yield url
    finally:
        process.terminate()
        process.wait(60)


def _wait_until_ready(process: "subprocess.Popen[bytes]", url: str, log: Path) -> None:
    end = time.monotonic() + START_WITHIN
    with Client(url) as client:
        while not client.ready(timeout=1):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < end, log.read_text()


def unused_port() -> int:
    """A port where nothing listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
