"""The hands that can be planned for."""

from fastapi import APIRouter

from fingersplit_client.schemas import HandInfo
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemKind
from fingersplit_service.runtime import RuntimeDependency
from fingersplit_service.security.access import Reader

__all__ = ["router"]

router = APIRouter(tags=["hands"])


@router.get("/v1/hands", summary="List the hands", responses=problem_answers(ProblemKind.NOT_READY))
async def list_hands(runtime: RuntimeDependency, _principal: Reader) -> list[HandInfo]:
    """Every hand with its fingers, joints and limits."""
    return runtime.hands()
