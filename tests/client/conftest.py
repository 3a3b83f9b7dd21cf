import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from app_transports import RunningApp, running_app
from client_calls import done
from fingersplit.objects.parametric import cylinder
from fingersplit_client import AsyncClient, Client, PlanResult

AnyClient = Client | AsyncClient


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
        with Client(url) as client:
            assert client.ready(timeout=900), "the service did not start"  # with nothing compiled yet it takes minutes
        yield url
    finally:
        process.terminate()
        process.wait(30)


@pytest.fixture(scope="session")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    """The same service in this process."""
    from fingersplit_service.app import create_app
    from fingersplit_service.settings import ServiceSettings

    settings = ServiceSettings(data_dir=tmp_path_factory.mktemp("app"), workers=1, spare_workers=0)
    with running_app(create_app(settings)) as running:
        yield running


@pytest.fixture(params=["blocking-socket", "awaited-socket", "blocking-app", "awaited-app"])
async def client(request: pytest.FixtureRequest) -> AsyncIterator[AnyClient]:
    """Each client against each service; call its operations with `done` and `items`."""
    mode, way = request.param.split("-")
    if way == "socket":
        made: AnyClient = (Client if mode == "blocking" else AsyncClient)(request.getfixturevalue("service"))
    elif mode == "blocking":
        made = Client("http://localhost", transport=request.getfixturevalue("app").blocking())
    else:
        made = AsyncClient("http://localhost", transport=request.getfixturevalue("app").awaited())
    yield made
    await done(made.close())


@pytest.fixture(scope="session")
def result(service: str, can: bytes) -> PlanResult:
    """A result of the real planner with a verified grasp."""
    with Client(service) as client:
        return client.plan(can, file_type="off", name="can", starts=16, seed=3, top_k=4, verified=1)


@pytest.fixture
def unused_url() -> str:
    """An address where nothing listens."""
    return f"http://127.0.0.1:{_unused_port()}"


def _unused_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="session")
def can() -> bytes:
    """A cylinder that a hand can grasp, OFF, metres."""
    mesh = cylinder()
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.faces)} 0"]
    lines += [" ".join(f"{x:.9g}" for x in vertex) for vertex in mesh.vertices]
    lines += ["3 " + " ".join(str(i) for i in face) for face in mesh.faces]
    return "\n".join(lines).encode()
