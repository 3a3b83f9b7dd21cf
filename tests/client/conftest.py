import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fingersplit.objects.parametric import cylinder
from fingersplit_client import ApiError, Client, ServiceUnreachable


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a real service with the real planner, in a process of its own."""
    port = _unused_port()
    program = Path(sys.executable).with_name("fingersplit")
    data = tmp_path_factory.mktemp("data")
    process = subprocess.Popen(
        [program, "serve", "--port", str(port), "--workers", "1", "--data-dir", data],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    url = f"http://127.0.0.1:{port}"
    try:
        _wait_until_ready(process, url)
        yield url
    finally:
        process.terminate()
        process.wait(10)


@pytest.fixture
def unused_url() -> str:
    """An address where nothing listens."""
    return f"http://127.0.0.1:{_unused_port()}"


def _unused_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _wait_until_ready(process: "subprocess.Popen[bytes]", url: str) -> None:
    end = time.monotonic() + 300  # with nothing compiled yet it takes minutes
    with Client(url) as client:
        while process.poll() is None and time.monotonic() < end:
            try:
                client.hands()
            except (ServiceUnreachable, ApiError):  # not listening, or not warm
                time.sleep(0.05)
            else:
                return
    raise RuntimeError("the service did not start")


@pytest.fixture(scope="session")
def can() -> bytes:
    """A cylinder that a hand can grasp, OFF, metres."""
    mesh = cylinder()
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.faces)} 0"]
    lines += [" ".join(f"{x:.9g}" for x in vertex) for vertex in mesh.vertices]
    lines += ["3 " + " ".join(str(i) for i in face) for face in mesh.faces]
    return "\n".join(lines).encode()
