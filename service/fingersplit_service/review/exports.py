"""Results as files of other tools."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Query, Response

from fingersplit.errors import ExchangeError
from fingersplit_service.endpoints.documents import JobId, known_job
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import RuntimeDependency
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
    runtime: RuntimeDependency,
    principal: Reader,
    job_id: JobId,
    format_name: Annotated[FormatName, Path(description="The format.")],
    rank: Annotated[int | None, Query(ge=1, description="Only this grasp; null for all feasible ones.")] = None,
) -> Response:
    """The feasible grasps, best first, or one grasp, feasible or not."""
    row, result = await known_job(runtime, principal, job_id)
    if not row.ended:
        raise ProblemError(ProblemKind.NOT_FINISHED, f"Job {job_id} is {row.state}; exports come with its result.")
    if result is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"Job {job_id} has no result.")
    deadline = runtime.settings.picture_deadline_s
    try:
        file = await runtime.engine.answer(runtime.tasks.convert, result, format_name, rank, deadline_s=deadline)
    except ExchangeError as error:
        raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field="/format_name") from error
    headers = {"Content-Disposition": f'attachment; filename="{job_id}-{format_name}{file.suffix}"'}
    return Response(file.content, headers=headers, media_type=file.media_type)
