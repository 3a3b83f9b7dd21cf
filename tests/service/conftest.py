import socket
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import anyio
import httpx2
import pytest
from fastapi import FastAPI

sys.path.insert(0, str(Path(__file__).parent))  # worker processes import the fakes by name

import fake_tasks

from fingersplit_service.app import create_app
from fingersplit_service.settings import ServiceSettings

Start = Callable[..., AbstractAsyncContextManager["Api"]]


def cube_file(edge: float) -> bytes:
    """A closed cube, OFF."""
    corners = [(x, y, z) for z in (0, edge) for x, y in ((0, 0), (edge, 0), (edge, edge), (0, edge))]
    faces = ["021", "032", "456", "467", "015", "054", "126", "165", "237", "276", "304", "347"]
    lines = ["OFF", "8 12 0", *(f"{x} {y} {z}" for x, y, z in corners), *(f"3 {' '.join(face)}" for face in faces)]
    return "\n".join(lines).encode() + b"\n"


class Api:
    """The service in this process, and a client that speaks to it without a socket."""

    cube = staticmethod(cube_file)

    def __init__(self, app: FastAPI, http: httpx2.AsyncClient) -> None:
        self.app, self.http = app, http
        self._object_id = ""

    async def upload(self, data: bytes, filename: str, **fields: str) -> httpx2.Response:
        return await self.http.post("/v1/objects", files={"file": (filename, data)}, data=fields)

    async def object_id(self) -> str:
        if not self._object_id:
            self._object_id = (await self.upload(cube_file(5), "cube.off", unit="cm")).json()["id"]
        return self._object_id

    async def queue(self, how: int, **fields: object) -> str:
        """Queue a job that goes as the fakes say."""
        body = {"object_id": await self.object_id(), "seed": how} | fields
        response = await self.http.post("/v1/jobs", json=body)
        assert response.status_code == 202, response.text
        return response.json()["id"]

    async def job(self, job_id: str) -> dict:
        return (await self.http.get(f"/v1/jobs/{job_id}")).json()

    async def ended(self, job_id: str, states: tuple[str, ...] = ("succeeded", "failed", "cancelled")) -> dict:
        """The job once it is in one of these states."""
        with anyio.fail_after(30):
            while (job := await self.job(job_id))["state"] not in states:
                await anyio.sleep(0.005)
            if job["state"] != "running":
                await self.app.state.runtime.dispatcher.released(job_id)  # it may still be recorded
        return job


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    return "asyncio"


@asynccontextmanager
async def started(data_dir: Path, **settings: object) -> AsyncIterator[Api]:
    chosen = ServiceSettings(data_dir=data_dir, **{"workers": 1, "spare_workers": 0, "stop_grace_s": 0} | settings)
    app = create_app(chosen, fake_tasks.TASKS)
    transport = httpx2.ASGITransport(app, raise_app_exceptions=False)
    async with (
        app.router.lifespan_context(app),
        httpx2.AsyncClient(transport=transport, base_url="http://localhost", timeout=30) as http,
    ):
        with anyio.fail_after(60):
            while (await http.get("/readyz")).status_code != 200:
                await anyio.sleep(0.02)
        yield Api(app, http)


@pytest.fixture(scope="session")
async def api(tmp_path_factory: pytest.TempPathFactory, anyio_backend: str) -> AsyncIterator[Api]:
    """One service for all tests that leave it as it was; uploads above 1 MB are too large."""
    settings = {"max_upload_bytes": 1_000_000, "max_request_bytes": 10_000}
    async with started(tmp_path_factory.mktemp("data"), **settings) as running:
        yield running


@pytest.fixture
def start() -> Start:
    """Start a service of one's own, on a given data directory."""
    return started


@pytest.fixture
def cube() -> bytes:
    """A cube of 60 mm, OFF, in centimetres."""
    return cube_file(6)


@pytest.fixture
def unused_port() -> int:
    """A port where nothing listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def service_environment(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """No setting comes from the surroundings."""
    import os

    for name in list(os.environ):
        if name.startswith("FINGERSPLIT_"):
            monkeypatch.delenv(name)
    return monkeypatch
