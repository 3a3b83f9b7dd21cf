"""Is a file known already? Clients ask before they send its bytes."""

from fastapi import APIRouter

from fingersplit_client.schemas import ObjectInfo, ObjectLookup
from fingersplit_service.dependencies import Objects
from fingersplit_service.endpoints.objects import PATH
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

router = APIRouter(tags=["objects"])


@router.post(
    PATH + "/lookup",
    summary="Find an object by its file's hash",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def find_object(objects: Objects, principal: Reader, lookup: ObjectLookup) -> ObjectInfo:
    """The object that a file became when it was uploaded with the same options; 404 where the file must be sent."""
    return await objects.find(principal.owner, lookup)
