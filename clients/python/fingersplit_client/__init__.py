"""Python client of the Fingersplit grasp-planning service.

>>> from fingersplit_client import Client
>>> with Client() as client:  # doctest: +SKIP
...     result = client.plan("mug.ply")
"""

from fingersplit_client._protocol import JobEvent
from fingersplit_client.async_client import AsyncClient
from fingersplit_client.client import DEFAULT_BASE_URL, Client
from fingersplit_client.errors import (
    ApiError,
    FingersplitClientError,
    JobFailed,
    ServiceUnreachable,
    WaitTimeout,
)
from fingersplit_client.schemas import (
    Batch,
    Grasp,
    HandInfo,
    ImportedGraspSet,
    Job,
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
    PlanResult,
    Problem,
)

__all__ = [
    "DEFAULT_BASE_URL",
    "ApiError",
    "AsyncClient",
    "Batch",
    "Client",
    "FingersplitClientError",
    "Grasp",
    "HandInfo",
    "ImportedGraspSet",
    "Job",
    "JobCreate",
    "JobEvent",
    "JobFailed",
    "JobPage",
    "JobSummary",
    "JobVerification",
    "ObjectInfo",
    "ObjectOptions",
    "ObjectPage",
    "ParallelGrasp",
    "ParallelGraspSet",
    "ParallelGraspSetInfo",
    "ParallelGraspsGenerate",
    "PlanResult",
    "Problem",
    "ServiceUnreachable",
    "WaitTimeout",
]
