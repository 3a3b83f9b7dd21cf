"""Whether the process is up, whether it can work, and how it fares."""

from fastapi import APIRouter, Response

from fingersplit_client.schemas import Health, Readiness
from fingersplit_service.dependencies import Operations
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Admin
from fingersplit_service.telemetry.metrics import METRICS_TYPE

__all__ = ["router"]

router = APIRouter(tags=["health"])


class _MetricsResponse(Response):
    """Prometheus' text."""

    media_type = METRICS_TYPE


@router.get("/healthz", summary="Is the process up?", responses=problem_answers())
async def get_health() -> Health:
    """Answer as long as the event loop runs."""
    return Health()


@router.get("/readyz", summary="Can it work?", responses=problem_answers(ProblemKind.NOT_READY))
async def get_readiness(health: Operations) -> Readiness:
    """Answer 200 only when jobs are accepted and start without delay; 503 while workers load and compile the planner,
    or while the database or the disk cannot take results.
    """  # noqa: D205
    return Readiness(workers=await health.check())


@router.get("/metrics", response_class=_MetricsResponse, summary="Metrics for Prometheus", responses=problem_answers())
async def get_metrics(health: Operations, _principal: Admin) -> _MetricsResponse:
    """Queue depth, times of requests, jobs and stages, worker restarts, verification rates."""
    return _MetricsResponse(await health.metrics())
