"""The clients: one set of operations, blocking in `Client` and awaited in `AsyncClient`."""

import os
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Generic, Self, Unpack

import httpx2

from fingersplit_client._exchange import Deadline, Policy
from fingersplit_client._flow import Flow, Pause, Send, Stream
from fingersplit_client._many import Planned, plan_many
from fingersplit_client._planning import KnownObjects, PlanRequest, plan
from fingersplit_client.mesh_files import MeshSource
from fingersplit_client.modes import Awaited, Blocking, Bound, Mode, operation, stream
from fingersplit_client.options import PlanKeywords
from fingersplit_client.resources.batches import Batches
from fingersplit_client.resources.datasets import Datasets
from fingersplit_client.resources.hands import Hands
from fingersplit_client.resources.jobs import Jobs
from fingersplit_client.resources.objects import Objects
from fingersplit_client.resources.outcomes import Outcomes
from fingersplit_client.resources.parallel_grasps import ParallelGrasps
from fingersplit_client.resources.scenes import Scenes
from fingersplit_client.results import PlanResult
from fingersplit_client.retries import Retries
from fingersplit_client.schemas import JobSummary, ObjectInfo

__all__ = ["DEFAULT_BASE_URL", "AsyncClient", "Client"]

DEFAULT_BASE_URL = "http://127.0.0.1:8000"
_READY_PAUSE = 0.1
_LIMITS = httpx2.Limits(max_connections=None, max_keepalive_connections=64)


class _Operations(Bound[Mode], Generic[Mode]):
    """What both clients can do.

    Attributes:
        objects: Meshes and point clouds.
        parallel_grasps: What planning starts from.
        hands: Hands that can be planned for.
        jobs: Plans, from the queue to the result.
        batches: Many jobs in one request.
        datasets: Many grasps of many objects.
        outcomes: What became of grasps on robots.
        scenes: Depth images cut into objects and scenes.
    """

    def __init__(self, mode: Mode) -> None:
        self._connections = mode
        self._known = KnownObjects()
        self.objects = Objects(mode)
        self.parallel_grasps = ParallelGrasps(mode)
        self.hands = Hands(mode)
        self.jobs = Jobs(mode)
        self.batches = Batches(mode)
        self.datasets = Datasets(mode)
        self.outcomes = Outcomes(mode)
        self.scenes = Scenes(mode)

    def _mode(self) -> Mode:
        return self._connections

    @operation
    def plan(
        self,
        mesh: MeshSource | ObjectInfo,
        *,
        timeout: float = 300.0,
        cancel: bool = True,
        on_progress: Callable[[JobSummary], None] | None = None,
        **options: Unpack[PlanKeywords],
    ) -> Flow[PlanResult[Mode]]:
        """Upload an object unless the service knows it, plan grasps for it and wait for them.

        Args:
            mesh: A path, an open binary file, the bytes of a file, vertices (n, 3) and triangles (m, 3), or an uploaded
                object.
            timeout: How long the whole call may take [s].
            cancel: Whether the job is cancelled where the call ends before it: at the timeout, by Ctrl-C, or because
                the task that waits is cancelled.
            on_progress: Called with the job whenever its state or progress changes.
            **options: Of the file: ``unit`` (``"m"``, ``"mm"``, ``"cm"`` or ``"in"``), ``scale``, ``name`` for people,
                ``file_type`` such as ``"stl"`` (needed with bytes), ``viewpoint`` of the camera that saw a point cloud,
                ``support``, the plane that its object stands on. Of the object: ``density`` [kg/m^3] or ``mass`` [kg],
                ``friction``, ``fairing`` [m]. Of the job: ``hand``, ``starts``, ``seed``, ``top_k``, ``source``,
                ``parallel_grasps``, ``parallel_grasp_set``, ``planner`` (settings by name), ``rank_by``,
                ``simulation_budget_ms`` and ``noise`` (how likely grasps hold when executed), ``refine``, ``verified``
                (how many grasps must hold in simulation), ``protocol``, ``controller``, ``simulated_friction``,
                ``verify_initial``, ``recording``, ``verify_first``, ``priority``, ``deadline_s``, ``scene``,
                ``approach``, ``contact_regions``, ``task``, ``end_effector``.
                `ObjectSource`, `ObjectOptions` and `JobCreate` have their meanings and defaults.

        Raises:
            InvalidRequestError: An option or the file is not valid.
            JobFailed: The job ended without a result.
            WaitTimeout: The time is over.
            OSError: The file cannot be read.
        """
        deadline = Deadline(timeout)
        asked = PlanRequest.of(options)
        return (
            yield from plan(self.objects, self._known, mesh, asked, deadline, cancel=cancel, on_progress=on_progress)
        )

    @stream
    def plan_many(
        self,
        meshes: "Iterable[os.PathLike[str] | str]",
        *,
        folder: "os.PathLike[str] | str | None" = None,
        at_once: int = 8,
        progress: bool | None = None,
        timeout: float = 3600.0,
        cancel: bool = True,
        **options: Unpack[PlanKeywords],
    ) -> Stream[Planned[Mode]]:
        """Plan for many files, some at a time; yields each as it ends, in no order.

        A file that cannot be planned for is an item with its error; the others go on. Only when the service is gone or
        refuses the key does the whole end with an error.

        Args:
            meshes: The files.
            folder: Where results are saved, one file for each. Those that are there already, of the same content and
                options, are not planned again, also after the program was killed.
            at_once: How many are in work at a time.
            progress: Whether a progress bar is shown on standard error; by default if that is a terminal.
            timeout: How long each may take, its place in the service's queue included [s].
            cancel: Whether jobs that have not ended are cancelled when the iteration is left.
            **options: See `plan`.
        """
        asked = PlanRequest.of(options)
        yield from plan_many(
            self.objects,
            self._known,
            meshes,
            asked,
            folder=folder,
            at_once=at_once,
            progress=progress,
            timeout=timeout,
            cancel=cancel,
        )

    @operation
    def ready(self, *, timeout: float = 0.0) -> Flow[bool]:
        """Whether the service is there and its workers are warm, so that jobs start without delay.

        Args:
            timeout: How long to wait for that at most [s].
        """
        deadline = Deadline(timeout)
        while True:
            try:
                response = yield Send("GET", "/readyz", timeout=self._policy.timeout)
                if response.is_success:
                    return True
            except httpx2.TransportError:
                pass
            if not deadline.left:
                return False
            yield Pause(min(_READY_PAUSE, deadline.left))


class Client(_Operations[Blocking]):
    """Talks to a Fingersplit service with blocking calls; threads may share it.

    Use it in a ``with`` statement, or call `close`. What can go wrong is a `FingersplitClientError`, one for each
    cause: `AuthenticationError`, `NotFoundError`, `InvalidRequestError`, `ConflictError`, `OverloadedError`,
    `JobFailed`, `WaitTimeout`, `RequestTimeout`, `ServiceUnreachable`.

    Args:
        base_url: Where the service listens; by default what ``FINGERSPLIT_SERVER`` says, else `DEFAULT_BASE_URL`.
        api_key: The key to send, where the service wants one; by default ``FINGERSPLIT_API_KEY``.
        timeout: How long to wait for one answer [s].
        retries: How requests are repeated that failed on their way.
        transport: How requests travel, when not over the network; for tests.
    """

    def __init__(
        self,
        base_url: str | None = None,
        *,
        api_key: str | None = None,
        timeout: float = 60.0,
        retries: Retries | None = None,
        transport: httpx2.BaseTransport | None = None,
    ) -> None:
        base_url = base_url or os.environ.get("FINGERSPLIT_SERVER") or DEFAULT_BASE_URL
        self._http = httpx2.Client(base_url=base_url, headers=_headers(api_key), limits=_LIMITS, transport=transport)
        super().__init__(Blocking(self._http, Policy(base_url, timeout, retries or Retries())))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()


class AsyncClient(_Operations[Awaited]):
    """Talks to a Fingersplit service with awaited calls; the operations, arguments and errors are those of `Client`.

    Use it in an ``async with`` statement, or await `close`; in asyncio.

    Args:
        base_url: Where the service listens; by default what ``FINGERSPLIT_SERVER`` says, else `DEFAULT_BASE_URL`.
        api_key: The key to send, where the service wants one; by default ``FINGERSPLIT_API_KEY``.
        timeout: How long to wait for one answer [s].
        retries: How requests are repeated that failed on their way.
        transport: How requests travel, when not over the network; for tests.
    """

    def __init__(
        self,
        base_url: str | None = None,
        *,
        api_key: str | None = None,
        timeout: float = 60.0,
        retries: Retries | None = None,
        transport: httpx2.AsyncBaseTransport | None = None,
    ) -> None:
        base_url = base_url or os.environ.get("FINGERSPLIT_SERVER") or DEFAULT_BASE_URL
        self._http = httpx2.AsyncClient(
            base_url=base_url, headers=_headers(api_key), limits=_LIMITS, transport=transport
        )
        super().__init__(Awaited(self._http, Policy(base_url, timeout, retries or Retries())))

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()


def _headers(api_key: str | None) -> dict[str, str]:
    key = api_key or os.environ.get("FINGERSPLIT_API_KEY")
    return {"Authorization": f"Bearer {key}"} if key else {}
