"""Results as files of other tools."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Response

from fingersplit_service.dependencies import Results
from fingersplit_service.endpoints.documents import JobId
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

router = APIRouter(tags=["jobs"])


@router.get(
    "/v1/jobs/{job_id}/export/{format_name}",
    summary="Get a job's grasps in another tool's format",
    response_class=Response,
    responses=problem_answers(
        ProblemKind.NOT_FOUND,
        ProblemKind.NOT_FINISHED,
        ProblemKind.GONE,
        ProblemKind.INVALID_REQUEST,
        ProblemKind.WORKER_FAILED,
    ),
)
async def export_job(
    results: Results,
    principal: Reader,
    job_id: JobId,
    format_name: Annotated[str, Path(description="A format of `GET /v1/formats` that is written.", max_length=64)],
    rank: Annotated[int | None, Query(ge=1, description="Only this grasp; null for all that can be executed.")] = None,
) -> Response:
    """The grasps that can be executed, best first, or one grasp, whatever is wrong with it."""
    file = await results.export(principal.owner, job_id, format_name, rank)
    headers = {"Content-Disposition": f'attachment; filename="{job_id}-{format_name}{file.suffix}"'}
    return Response(file.content, headers=headers, media_type=file.media_type)
