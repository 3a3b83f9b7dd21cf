"""Sessions: a browser trades a key for a cookie that its pages cannot read."""

from typing import Annotated

from fastapi import APIRouter, Cookie, Request, Response

from fingersplit_client.schemas import SessionCreate, SessionInfo
from fingersplit_service.dependencies import KeyAccess
from fingersplit_service.problems import ProblemError, ProblemKind, problem_answers
from fingersplit_service.security.access import Reader
from fingersplit_service.security.sessions import LIFETIME, SESSION_COOKIE

__all__ = ["router"]

PATH = "/review/session"
router = APIRouter(tags=["sessions"])


@router.post(
    PATH,
    summary="Open a session",
    responses=problem_answers(ProblemKind.UNAUTHENTICATED, ProblemKind.INVALID_REQUEST),
)
async def open_session(access: KeyAccess, request: Request, response: Response, asked: SessionCreate) -> SessionInfo:
    """Set a cookie that stands for a key until the key is revoked, for at most twelve hours."""
    principal = await access.of_key(asked.key)
    if principal is None:
        raise ProblemError(ProblemKind.UNAUTHENTICATED, "That is no valid API key.", field="/key")
    response.set_cookie(
        SESSION_COOKIE,
        access.sessions.begin(principal.owner),
        max_age=int(LIFETIME),
        secure=request.url.scheme == "https",
        httponly=True,
        samesite="strict",
    )
    return SessionInfo(name=principal.name, scopes=list(principal.scopes))


@router.get(PATH, summary="Who am I?", responses=problem_answers())
async def get_session(principal: Reader) -> SessionInfo:
    """Whose key or session this request carries."""
    return SessionInfo(name=principal.name, scopes=list(principal.scopes))


@router.delete(
    PATH, status_code=204, summary="Close the session", responses=problem_answers(ProblemKind.INVALID_REQUEST)
)
async def close_session(
    access: KeyAccess,
    session: Annotated[str | None, Cookie(alias=SESSION_COOKIE, include_in_schema=False)] = None,
) -> Response:
    """Forget the session and delete its cookie."""
    access.sessions.end(session or "")
    response = Response(status_code=204)
    response.delete_cookie(SESSION_COOKIE, httponly=True, samesite="strict")
    return response
