"""Python client of the Fingersplit grasp-planning service.

>>> from fingersplit_client import Client
>>> with Client() as client:  # doctest: +SKIP
...     grasp = client.plan("mug.ply", mass=0.3).best
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingersplit_client._events import JobEvent
    from fingersplit_client._many import Planned
    from fingersplit_client.client import DEFAULT_BASE_URL, AsyncClient, Client
    from fingersplit_client.errors import (
        ApiError,
        AuthenticationError,
        ConflictError,
        FingersplitClientError,
        InvalidRequestError,
        JobFailed,
        NotFoundError,
        OverloadedError,
        RequestTimeout,
        ServiceUnreachable,
        WaitTimeout,
    )
    from fingersplit_client.grasps import Grasp, PlacedGrasp, Pregrasp
    from fingersplit_client.modes import Awaited, Blocking
    from fingersplit_client.results import Job, PlanResult
    from fingersplit_client.retries import Retries
    from fingersplit_client.schemas import (
        Batch,
        HandDetail,
        HandInfo,
        ImportedGraspSet,
        JobCreate,
        JobPage,
        JobSummary,
        JobVerification,
        ObjectInfo,
        ObjectOptions,
        ObjectPage,
        ParallelGrasp,
        ParallelGraspSet,
        ParallelGraspSetInfo,
        ParallelGraspsGenerate,
        Problem,
    )
    from fingersplit_client.transforms import Transform

__all__ = [
    "DEFAULT_BASE_URL",
    "ApiError",
    "AsyncClient",
    "AuthenticationError",
    "Awaited",
    "Batch",
    "Blocking",
    "Client",
    "ConflictError",
    "FingersplitClientError",
    "Grasp",
    "HandDetail",
    "HandInfo",
    "ImportedGraspSet",
    "InvalidRequestError",
    "Job",
    "JobCreate",
    "JobEvent",
    "JobFailed",
    "JobPage",
    "JobSummary",
    "JobVerification",
    "NotFoundError",
    "ObjectInfo",
    "ObjectOptions",
    "ObjectPage",
    "OverloadedError",
    "ParallelGrasp",
    "ParallelGraspSet",
    "ParallelGraspSetInfo",
    "ParallelGraspsGenerate",
    "PlacedGrasp",
    "PlanResult",
    "Planned",
    "Pregrasp",
    "Problem",
    "RequestTimeout",
    "Retries",
    "ServiceUnreachable",
    "Transform",
    "WaitTimeout",
]

_HOMES = ("client", "results", "grasps", "errors", "modes", "retries", "transforms", "_events", "_many", "schemas")
"""Modules that names come from, when they are first asked for; what results extend comes after them."""


def __getattr__(name: str) -> Any:
    if name in __all__:
        for home in _HOMES:
            module = import_module(f"{__name__}.{home}")
            if name in module.__all__:
                return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
