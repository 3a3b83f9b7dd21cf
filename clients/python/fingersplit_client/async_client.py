"""The client for asyncio."""

from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar, Unpack

import httpx2

from fingersplit_client import _jobs, _objects
from fingersplit_client._protocol import EventReader, Flow, JobEvent, default_headers, problem
from fingersplit_client.client import DEFAULT_BASE_URL
from fingersplit_client.errors import ApiError, ServiceUnreachable
from fingersplit_client.schemas import (
    Batch,
    Grasp,
    GraspFormat,
    HandInfo,
    ImportedGraspSet,
    Job,
    JobCreate,
    JobPage,
    JobState,
    JobVerification,
    ObjectInfo,
    ObjectOptions,
    ObjectPage,
    ParallelGrasp,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
    PlanResult,
)

__all__ = ["AsyncClient"]

Result = TypeVar("Result")


class AsyncClient:
    """Talks to a Fingersplit service with awaited calls; the methods are those of `Client`.

    Use it in an ``async with`` statement, or await `close`. Every method raises `ApiError` when the service
    refuses the request and `ServiceUnreachable` when no answer comes.

    Args:
        base_url: Where the service listens.
        api_key: The key to send, where the service wants one.
        timeout: How long to wait for one answer [s].
        transport: How requests travel, when not over the network; for tests.
    """

    def __init__(
        self,
        base_url: str = DEFAULT_BASE_URL,
        *,
        api_key: str | None = None,
        timeout: float = 60.0,
        transport: httpx2.AsyncBaseTransport | None = None,
    ) -> None:
        self._http = httpx2.AsyncClient(
            base_url=base_url, timeout=timeout, transport=transport, headers=default_headers(api_key)
        )

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def upload_object(
        self,
        mesh: Path | str | bytes,
        *,
        unit: str = "m",
        name: str | None = None,
        file_type: str | None = None,
        options: ObjectOptions | None = None,
        viewpoint: Sequence[float] | None = None,
    ) -> ObjectInfo:
        """Upload a mesh or a point cloud; the same one with the same options is always the same object.

        Args:
            mesh: A file, or the bytes of one.
            unit: Length unit of the file: ``"m"``, ``"mm"``, ``"cm"`` or ``"in"``.
            name: Name for people; by default that of the file.
            file_type: Format, such as ``"stl"``; by default the file's suffix. Needed with bytes.
            options: Mass, friction and what else is known of the object.
            viewpoint: Where the camera stood that saw a point cloud, in the file's frame and unit.
        """
        return await self._run(_objects.upload_object(mesh, unit, name, file_type, options, viewpoint))

    async def get_object(self, object_id: str) -> ObjectInfo:
        """One object and what was found in its file."""
        return await self._run(_objects.get_object(object_id))

    async def list_objects(self, *, limit: int = 100, cursor: str | None = None) -> ObjectPage:
        """A page of the objects, newest first; ``next_cursor`` of one page is ``cursor`` of the next."""
        return await self._run(_objects.list_objects(limit, cursor))

    async def delete_object(self, object_id: str) -> None:
        """Delete an object and its parallel grasps."""
        return await self._run(_objects.delete_object(object_id))

    async def mesh(self, object_id: str, file_type: str = "ply") -> bytes:
        """The checked mesh of an object in metres, as a ply, stl, obj, glb or off file."""
        return await self._run(_objects.mesh(object_id, file_type))

    async def generate_parallel_grasps(
        self, object_id: str, request: ParallelGraspsGenerate | None = None
    ) -> ParallelGraspSet:
        """Have parallel grasps of an object found and stored as a set, by default for the default hand."""
        return await self._run(_objects.generate_parallel_grasps(object_id, request or ParallelGraspsGenerate()))

    async def import_parallel_grasps(
        self, object_id: str, grasps: Sequence[ParallelGrasp], *, name: str = ""
    ) -> ParallelGraspSet:
        """Store parallel grasps that were found elsewhere as a set."""
        return await self._run(_objects.import_parallel_grasps(object_id, grasps, name))

    async def import_grasp_file(
        self, object_id: str, file: Path | str | bytes, *, file_format: GraspFormat | None = None, name: str = ""
    ) -> ImportedGraspSet:
        """Store the parallel grasps in a file that another tool wrote, or in the bytes of one; the best 1024 of them.

        Its content tells the format unless ``file_format`` does, its name that of the set unless ``name`` does.
        """
        return await self._run(_objects.import_grasp_file(object_id, file, file_format, name))

    async def list_parallel_grasps(self, object_id: str) -> list[ParallelGraspSetInfo]:
        """The sets of parallel grasps of an object, newest first."""
        return await self._run(_objects.list_parallel_grasps(object_id))

    async def parallel_grasps(self, object_id: str, set_id: str) -> ParallelGraspSet:
        """One set of parallel grasps."""
        return await self._run(_objects.parallel_grasps(object_id, set_id))

    async def delete_parallel_grasps(self, object_id: str, set_id: str) -> None:
        """Delete a set of parallel grasps."""
        return await self._run(_objects.delete_parallel_grasps(object_id, set_id))

    async def create_job(self, request: JobCreate, *, wait: float = 0.0, idempotency_key: str | None = None) -> Job:
        """Queue a job.

        Args:
            request: What to plan.
            wait: How long the service may wait for the job's end before it answers [s].
            idempotency_key: With the same key a repeated call returns the first one's job.
        """
        return await self._run(_jobs.create_job(request, wait, idempotency_key))

    async def get_job(self, job_id: str, *, wait: float = 0.0) -> Job:
        """Where a job stands, with its result once it has succeeded.

        Args:
            job_id: Id of the job.
            wait: How long the service may wait for the job's end before it answers [s].
        """
        return await self._run(_jobs.get_job(job_id, wait))

    async def list_jobs(
        self,
        *,
        limit: int = 100,
        cursor: str | None = None,
        state: Sequence[JobState] = (),
        object_id: str | None = None,
        hand: str | None = None,
        batch_id: str | None = None,
    ) -> JobPage:
        """A page of the jobs, newest first; ``next_cursor`` of one page is ``cursor`` of the next.

        Args:
            limit: How many to return at most.
            cursor: Where to go on.
            state: Only jobs in one of these states.
            object_id: Only jobs of this object.
            hand: Only jobs for this hand.
            batch_id: Only jobs of this batch.
        """
        return await self._run(_jobs.list_jobs(limit, cursor, state, object_id, hand, batch_id))

    async def cancel_job(self, job_id: str) -> Job:
        """End a job that has not ended; one that has stays as it is."""
        return await self._run(_jobs.cancel_job(job_id))

    async def delete_job(self, job_id: str) -> None:
        """Delete a job with its result, pictures and recordings; one that has not ended is cancelled first."""
        return await self._run(_jobs.delete_job(job_id))

    async def create_batch(self, requests: Sequence[JobCreate]) -> Batch:
        """Queue many jobs; all are accepted, or none is."""
        return await self._run(_jobs.create_batch(requests))

    async def get_batch(self, batch_id: str) -> Batch:
        """How the jobs of a batch stand together."""
        return await self._run(_jobs.get_batch(batch_id))

    async def wait(self, job: Job, timeout: float = 300.0, on_progress: _jobs.Progress | None = None) -> Job:
        """Wait until a job has succeeded.

        Args:
            job: A job of this service.
            timeout: How long to wait at most [s].
            on_progress: Called with the job each time it is looked at.

        Raises:
            JobFailed: It ended without a result.
            WaitTimeout: The time is over; the job goes on.
        """
        return await self._run(_jobs.wait(job, timeout, on_progress))

    async def plan(
        self,
        mesh: Path | str | bytes,
        *,
        unit: str = "m",
        name: str | None = None,
        file_type: str | None = None,
        timeout: float = 300.0,
        on_progress: _jobs.Progress | None = None,
        **options: Unpack[_jobs.PlanOptions],
    ) -> PlanResult:
        """Upload a mesh, plan grasps for it and wait for them.

        Args:
            mesh: See `upload_object`.
            unit: See `upload_object`.
            name: See `upload_object`.
            file_type: See `upload_object`.
            timeout: See `wait`.
            on_progress: See `wait`.
            **options: Fields of `JobCreate`, such as hand, starts, seed, planner and verified.
        """
        flow = _jobs.plan(mesh, unit, name, file_type, timeout, on_progress, options)
        return await self._run(flow)

    async def ready(self) -> bool:
        """Whether the service is ready: its workers are warm and jobs start without delay."""
        return await self._run(_jobs.ready())

    async def hands(self) -> list[HandInfo]:
        """The hands that can be planned for."""
        return await self._run(_jobs.hands())

    async def picture(self, job_id: str, rank: int = 1) -> bytes:
        """PNG of one grasp of a job: hand and object at the start and at the end, and the quality curve."""
        return await self._run(_jobs.picture(job_id, rank))

    async def grasps(self, job_id: str) -> list[Grasp]:
        """The ranked grasps of a job that has ended."""
        return await self._run(_jobs.grasps(job_id))

    async def verification(self, job_id: str) -> JobVerification:
        """What simulation showed of a job's grasps."""
        return await self._run(_jobs.verification(job_id))

    async def recording(self, job_id: str, rank: int = 1) -> bytes:
        """Recording of one grasp of a job, for the Rerun viewer."""
        return await self._run(_jobs.recording(job_id, rank))

    async def events(self, job_id: str, *, last_event_id: str | None = None) -> AsyncIterator[JobEvent]:
        """Follow a job until it has ended.

        Args:
            job_id: Id of the job.
            last_event_id: The last event that was seen; only later ones come.
        """
        headers = {"Last-Event-ID": last_event_id} if last_event_id else {}
        reader = EventReader()
        try:
            async with self._http.stream("GET", _jobs.events_path(job_id), headers=headers) as response:
                if not response.is_success:
                    await response.aread()
                    raise ApiError(problem(response))
                async for line in response.aiter_lines():
                    event = reader.read(line)
                    if event is not None:
                        yield event
        except httpx2.TransportError as error:
            raise ServiceUnreachable(f"The events of job {job_id} broke off: {error}") from error

    async def _run(self, flow: Flow[Result]) -> Result:
        try:
            call = next(flow)
            while True:
                call = flow.send(await self._http.request(call.method, call.path, **call.arguments))
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        except httpx2.TransportError as error:
            raise ServiceUnreachable(f"No answer from {self._http.base_url}: {error}") from error
