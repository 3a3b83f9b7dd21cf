import os
from collections.abc import AsyncIterator, Iterator

import pytest

from app_transports import RunningApp, running_app
from client_calls import done
from fingersplit.objects.parametric import cylinder
from fingersplit_client import AsyncClient, Client, PlanResult
from serving import serving, unused_port

AnyClient = Client | AsyncClient
NOT_BEHIND = {"FINGERSPLIT_VERIFY_FIRST": "false"}
"""Only what is asked for is verified; that the service does it by itself is for its own tests."""


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a real service with the real planner, in a process of its own."""
    with serving(tmp_path_factory.mktemp("data"), "--workers", 1, environment=os.environ | NOT_BEHIND) as url:
        yield url


@pytest.fixture(scope="session")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    """The same service in this process."""
    from fingersplit_service.app import create_app
    from fingersplit_service.settings import ServiceSettings

    settings = ServiceSettings(data_dir=tmp_path_factory.mktemp("app"), workers=1, spare_workers=0, verify_first=False)
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
    return f"http://127.0.0.1:{unused_port()}"


@pytest.fixture(scope="session")
def can() -> bytes:
    """A cylinder that a hand can grasp, OFF, metres."""
    mesh = cylinder()
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.faces)} 0"]
    lines += [" ".join(f"{x:.9g}" for x in vertex) for vertex in mesh.vertices]
    lines += ["3 " + " ".join(str(i) for i in face) for face in mesh.faces]
    return "\n".join(lines).encode()
