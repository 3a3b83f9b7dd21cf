"""Python client of the Fingersplit grasp-planning service.

>>> from fingersplit_client import Client
>>> with Client() as client:  # doctest: +SKIP
...     result = client.plan("mug.ply")
"""

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
    HandInfo,
    Job,
    JobCreate,
    ObjectInfo,
    ParallelGrasp,
    PlanResult,
    Problem,
)

__all__ = [
    "DEFAULT_BASE_URL",
    "ApiError",
    "AsyncClient",
    "Client",
    "FingersplitClientError",
    "HandInfo",
    "Job",
    "JobCreate",
    "JobFailed",
    "ObjectInfo",
    "ParallelGrasp",
    "PlanResult",
    "Problem",
    "ServiceUnreachable",
    "WaitTimeout",
]
