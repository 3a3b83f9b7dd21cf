"""The hands that can be planned for."""

from fastapi import APIRouter

from fingersplit_client.schemas import HandInfo
from fingersplit_service.dependencies import Hands
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

router = APIRouter(tags=["hands"])


@router.get("/v1/hands", summary="List the hands", responses=problem_answers(ProblemKind.NOT_READY))
async def list_hands(hands: Hands, _principal: Reader) -> list[HandInfo]:
    """Every hand with its fingers, joints and limits."""
    return hands.all()
