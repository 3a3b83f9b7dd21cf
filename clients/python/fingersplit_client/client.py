"""The blocking client."""

import time
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar, Unpack

import httpx2

from fingersplit_client import _protocol
from fingersplit_client.errors import ServiceUnreachable
from fingersplit_client.schemas import HandInfo, Job, JobCreate, ObjectInfo, PlanResult

__all__ = ["DEFAULT_BASE_URL", "Client"]

DEFAULT_BASE_URL = "http://127.0.0.1:8000"

Result = TypeVar("Result")


class Client:
    """Talks to a Fingersplit service with blocking calls.

    Use it in a ``with`` statement, or call `close`. Every method raises `ApiError` when the service
    refuses the request and `ServiceUnreachable` when no answer comes.

    Args:
        base_url: Where the service listens.
        timeout: How long to wait for one answer [s].
        transport: How requests travel, when not over the network; for tests.
    """

    def __init__(
        self,
        base_url: str = DEFAULT_BASE_URL,
        *,
        timeout: float = 60.0,
        transport: httpx2.BaseTransport | None = None,
    ) -> None:
        self._http = httpx2.Client(base_url=base_url, timeout=timeout, transport=transport)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def upload_object(
        self,
        mesh: Path | str | bytes,
        *,
        unit: str = "m",
        name: str | None = None,
        file_type: str | None = None,
    ) -> ObjectInfo:
        """Upload a mesh; the same mesh is always the same object.

        Args:
            mesh: A file, or the bytes of one.
            unit: Length unit of the file: ``"m"``, ``"mm"``, ``"cm"`` or ``"in"``.
            name: Name for people; by default that of the file.
            file_type: Format, such as ``"stl"``; by default the file's suffix. Needed with bytes.
        """
        return self._run(_protocol.upload_object(mesh, unit, name, file_type))

    def create_job(self, request: JobCreate) -> Job:
        """Queue a job; returns at once."""
        return self._run(_protocol.create_job(request))

    def get_job(self, job_id: str) -> Job:
        """Where a job stands, with its result once it has succeeded."""
        return self._run(_protocol.get_job(job_id))

    def wait(self, job: Job, timeout: float = 300.0, on_progress: _protocol.Progress | None = None) -> Job:
        """Wait until a job has succeeded.

        Args:
            job: A job of this service.
            timeout: How long to wait at most [s].
            on_progress: Called with the job each time it is looked at.

        Raises:
            JobFailed: It ended without a result.
            WaitTimeout: The time is over; the job goes on.
        """
        return self._run(_protocol.wait(job, timeout, on_progress))

    def plan(
        self,
        mesh: Path | str | bytes,
        *,
        unit: str = "m",
        name: str | None = None,
        file_type: str | None = None,
        timeout: float = 300.0,
        on_progress: _protocol.Progress | None = None,
        **options: Unpack[_protocol.PlanOptions],
    ) -> PlanResult:
        """Upload a mesh, plan grasps for it and wait for them.

        Args:
            mesh: See `upload_object`.
            unit: See `upload_object`.
            name: See `upload_object`.
            file_type: See `upload_object`.
            timeout: See `wait`.
            on_progress: See `wait`.
            **options: Fields of `JobCreate`: hand, parallel_grasps, starts, seed, top_k, planner.
        """
        flow = _protocol.plan(mesh, unit, name, file_type, timeout, on_progress, options)
        return self._run(flow)

    def ready(self) -> bool:
        """Whether the service is ready: its workers are warm and jobs start without delay."""
        return self._run(_protocol.ready())

    def hands(self) -> list[HandInfo]:
        """The hands that can be planned for."""
        return self._run(_protocol.hands())

    def picture(self, job_id: str, rank: int = 1) -> bytes:
        """PNG of one grasp of a job: hand and object at the start and at the end, and the quality curve."""
        return self._run(_protocol.picture(job_id, rank))

    def _run(self, flow: _protocol.Flow[Result]) -> Result:
        response: httpx2.Response | None = None
        while True:
            try:
                step = flow.send(response)
            except StopIteration as end:
                return end.value  # type: ignore[no-any-return]
            if isinstance(step, _protocol.Pause):
                time.sleep(step.seconds)
                response = None
                continue
            try:
                response = self._http.request(step.method, step.path, **step.arguments)
            except httpx2.TransportError as error:
                raise ServiceUnreachable(f"No answer from {self._http.base_url}: {error}") from error
