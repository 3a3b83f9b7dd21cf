"""What the planner knows beside hands: metrics, file formats, sources of parallel grasps, protocols, controllers."""

from fastapi import APIRouter

from fingersplit_client.schemas import ControllerInfo, FileFormatInfo, MetricInfo, ProtocolInfo, SourceInfo
from fingersplit_service.dependencies import Catalog
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

router = APIRouter(tags=["catalogs"])
_PROBLEMS = problem_answers(ProblemKind.NOT_READY)


@router.get("/v1/metrics", summary="List the metrics of a grasp", responses=_PROBLEMS)
async def list_metrics(catalog: Catalog, _principal: Reader) -> list[MetricInfo]:
    """Every metric that grasps have in `metrics`, with unit, meaning and which way is better."""
    return catalog.metrics()


@router.get("/v1/formats", summary="List the file formats", responses=_PROBLEMS)
async def list_formats(catalog: Catalog, _principal: Reader) -> list[FileFormatInfo]:
    """Every file format of other tools, and whether it is read or written."""
    return catalog.formats()


@router.get("/v1/sources", summary="List the sources of parallel grasps", responses=_PROBLEMS)
async def list_sources(catalog: Catalog, _principal: Reader) -> list[SourceInfo]:
    """Every way to find parallel grasps when a job brings none."""
    return catalog.sources()


@router.get("/v1/protocols", summary="List the verification protocols", responses=_PROBLEMS)
async def list_protocols(catalog: Catalog, _principal: Reader) -> list[ProtocolInfo]:
    """Every test that grasps can be verified with."""
    return catalog.protocols()


@router.get("/v1/controllers", summary="List the controllers of the simulated hand", responses=_PROBLEMS)
async def list_controllers(catalog: Catalog, _principal: Reader) -> list[ControllerInfo]:
    """Every way to control the hand while a grasp is verified."""
    return catalog.controllers()
