"""What endpoints ask for as parameters, each by what it does and not by where it lives."""

from typing import Annotated

from fastapi import Depends, Request

from fingersplit_service.jobs.dataset_service import DatasetService
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.hand_service import HandService
from fingersplit_service.jobs.job_service import JobService
from fingersplit_service.jobs.object_service import ObjectService
from fingersplit_service.jobs.outcome_service import OutcomeService
from fingersplit_service.jobs.parallel_grasp_service import ParallelGraspService
from fingersplit_service.jobs.result_service import ResultService
from fingersplit_service.jobs.usage import UsageService
from fingersplit_service.operations.health import HealthService
from fingersplit_service.runtime import Runtime
from fingersplit_service.security.access import Access
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = [
    "Catalog",
    "Datasets",
    "Files",
    "Hands",
    "Jobs",
    "KeyAccess",
    "Objects",
    "Operations",
    "Outcomes",
    "OwnersUse",
    "ParallelGrasps",
    "Results",
    "Settings",
]


# All of them are ``async``: without, each request would wait for a thread.
def _runtime(request: Request) -> Runtime:
    runtime: Runtime = request.app.state.runtime
    return runtime


async def _jobs(request: Request) -> JobService:
    return _runtime(request).jobs


async def _objects(request: Request) -> ObjectService:
    return _runtime(request).objects


async def _parallel_grasps(request: Request) -> ParallelGraspService:
    return _runtime(request).parallel_grasps


async def _results(request: Request) -> ResultService:
    return _runtime(request).results


async def _outcomes(request: Request) -> OutcomeService:
    return _runtime(request).outcomes


async def _datasets(request: Request) -> DatasetService:
    return _runtime(request).datasets


async def _hands(request: Request) -> HandService:
    return _runtime(request).hands


async def _catalog(request: Request) -> HandCatalog:
    return _runtime(request).catalog


async def _health(request: Request) -> HealthService:
    return _runtime(request).health


async def _access(request: Request) -> Access:
    return _runtime(request).access


async def _settings(request: Request) -> ServiceSettings:
    return _runtime(request).settings


async def _storage(request: Request) -> Storage:
    return _runtime(request).storage


async def _usage(request: Request) -> UsageService:
    return _runtime(request).usage


Jobs = Annotated[JobService, Depends(_jobs)]
Objects = Annotated[ObjectService, Depends(_objects)]
ParallelGrasps = Annotated[ParallelGraspService, Depends(_parallel_grasps)]
Results = Annotated[ResultService, Depends(_results)]
Outcomes = Annotated[OutcomeService, Depends(_outcomes)]
Datasets = Annotated[DatasetService, Depends(_datasets)]
Hands = Annotated[HandService, Depends(_hands)]
Catalog = Annotated[HandCatalog, Depends(_catalog)]
Operations = Annotated[HealthService, Depends(_health)]
KeyAccess = Annotated[Access, Depends(_access)]
Settings = Annotated[ServiceSettings, Depends(_settings)]
Files = Annotated[Storage, Depends(_storage)]
OwnersUse = Annotated[UsageService, Depends(_usage)]
