"""Results as files of other tools."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Response

from fingersplit_service.dependencies import Results
from fingersplit_service.endpoints.documents import JobId
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["FormatName", "router"]

FormatName = Literal["isaac_grasp", "moveit", "moveit_yaml", "dexgraspbench", "multi_gripper_grasp", "dexgraspnet"]
"""The names of ``fingersplit.formats.EXPORT_FORMATS``, which only workers load."""
router = APIRouter(tags=["jobs"])


@router.get(
    "/v1/jobs/{job_id}/export/{format_name}",
    summary="Get a job's grasps in another tool's format",
    response_class=Response,
    responses=problem_answers(
        ProblemKind.NOT_FOUND, ProblemKind.NOT_FINISHED, ProblemKind.INVALID_REQUEST, ProblemKind.WORKER_FAILED
    ),
)
async def export_job(
    results: Results,
    principal: Reader,
    job_id: JobId,
    format_name: Annotated[FormatName, Path(description="The format.")],
    rank: Annotated[int | None, Query(ge=1, description="Only this grasp; null for all feasible ones.")] = None,
) -> Response:
    """The feasible grasps, best first, or one grasp, feasible or not."""
    file = await results.export(principal.owner, job_id, format_name, rank)
    headers = {"Content-Disposition": f'attachment; filename="{job_id}-{format_name}{file.suffix}"'}
    return Response(file.content, headers=headers, media_type=file.media_type)
