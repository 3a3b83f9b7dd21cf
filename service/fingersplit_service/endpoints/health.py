"""Whether the process is up, whether its workers are warm, and how it fares."""

from fastapi import APIRouter, Response

from fingersplit_client.schemas import Health, Readiness
from fingersplit_service.openapi import problem_answers
from fingersplit_service.operations.metrics import METRICS_TYPE
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import RuntimeDependency
from fingersplit_service.security.access import Admin

__all__ = ["router"]

router = APIRouter(tags=["health"])


class _MetricsResponse(Response):
    """Prometheus' text."""

    media_type = METRICS_TYPE


@router.get("/healthz", summary="Is the process up?", responses=problem_answers())
async def healthz() -> Health:
    """Answer as long as the event loop runs."""
    return Health()


@router.get("/readyz", summary="Are the workers warm?", responses=problem_answers(ProblemKind.NOT_READY))
async def readyz(runtime: RuntimeDependency) -> Readiness:
    """Answer 200 only when jobs start without delay; 503 while workers load and compile the planner."""
    if not runtime.engine.ready:
        raise ProblemError(ProblemKind.NOT_READY, "The workers are still starting; try again in a second.")
    return Readiness(workers=runtime.engine.warm_workers)


@router.get("/metrics", response_class=_MetricsResponse, summary="Metrics for Prometheus", responses=problem_answers())
async def metrics(runtime: RuntimeDependency, _principal: Admin) -> _MetricsResponse:
    """Queue depth, times of requests, jobs and stages, worker restarts, verification rates."""
    return _MetricsResponse(runtime.metrics.expose(runtime.engine, await runtime.jobs.counts()))
