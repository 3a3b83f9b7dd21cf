"""Jobs: queue a plan, see how it stands, see its grasps."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Body, Path, Query, Response
from fastapi.responses import FileResponse

from fingersplit.errors import ParallelGraspError, SettingsError
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.splitting.settings import PlannerSettings
from fingersplit_client.schemas import Job, JobCreate, JobSummary
from fingersplit_service.jobs.store import JobRow
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency

__all__ = ["PATH", "router"]

PATH = "/v1/jobs"
router = APIRouter(tags=["jobs"])

JobId = Annotated[str, Path(description="Id of a job.", max_length=64)]

_EXAMPLES = {
    "find": {
        "summary": "Have parallel grasps found",
        "value": {
            "object_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
            "hand": "barrett",
            "starts": 64,
            "seed": 1,
        },
    },
    "given": {
        "summary": "Start from a given parallel grasp, with a tighter pad angle",
        "value": {
            "object_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
            "parallel_grasps": [{"contacts": [[0.03, 0.0, 0.05], [-0.03, 0.0, 0.05]], "approach": [0.0, 0.0, -1.0]}],
            "planner": {"pad_angle_limit": 0.5},
        },
    },
}


class _PngResponse(FileResponse):
    """A PNG file."""

    media_type = "image/png"


@router.post(
    PATH,
    status_code=202,
    response_model=Job,
    summary="Queue a job",
    responses=problem_answers(
        ProblemKind.BAD_REQUEST, ProblemKind.TOO_LARGE, ProblemKind.INVALID_REQUEST, ProblemKind.NOT_READY
    ),
)
async def create_job(
    runtime: RuntimeDependency, asked: Annotated[JobCreate, Body(openapi_examples=_EXAMPLES)]
) -> Response:
    """Ask for grasps. The answer comes once the job is on disk: what was accepted is not lost."""
    _check(runtime, asked)
    row = await runtime.store.add_job(asked.object_id, asked.model_dump_json())
    if row is None:
        raise ProblemError(
            ProblemKind.INVALID_REQUEST,
            f"There is no object {asked.object_id!r}; upload its mesh to /v1/objects first.",
            field="/object_id",
        )
    runtime.dispatcher.wake()
    return _json(_with_result(_summary(runtime, row), None), 202, {"Location": f"{PATH}/{row.id}"})


@router.get(
    PATH,
    response_model=list[JobSummary],
    summary="List the jobs",
    responses=problem_answers(ProblemKind.INVALID_REQUEST),
)
async def list_jobs(
    runtime: RuntimeDependency,
    limit: Annotated[int, Query(ge=1, le=1000, description="How many to return at most.")] = 100,
) -> list[JobSummary]:
    """The newest jobs, newest first, without their results."""
    return [_summary(runtime, row) for row in await runtime.store.newest_jobs(limit)]


@router.get(
    PATH + "/{job_id}",
    response_model=Job,
    summary="Get a job",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def get_job(runtime: RuntimeDependency, job_id: JobId) -> Response:
    """Where a job stands, and its grasps once it has succeeded."""
    row = await _known_job(runtime, job_id)
    result = await runtime.store.result(job_id) if row.state == "succeeded" else None
    return _json(_with_result(_summary(runtime, row), result))


@router.get(
    PATH + "/{job_id}/grasps/{rank}/picture.png",
    response_class=_PngResponse,
    summary="See a grasp",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.NOT_FINISHED, ProblemKind.INVALID_REQUEST),
)
async def get_picture(
    runtime: RuntimeDependency,
    job_id: JobId,
    rank: Annotated[int, Path(description="Rank of the grasp, from 1.")],
) -> _PngResponse:
    """Hand and object at the start and at the end, beside the quality curve. Drawn when first asked for."""
    row = await _known_job(runtime, job_id)
    if row.state in ("queued", "running"):
        raise ProblemError(ProblemKind.NOT_FINISHED, f"Job {job_id} is {row.state}; pictures come with its result.")
    if not 1 <= rank <= (row.grasps or 0):
        raise ProblemError(ProblemKind.NOT_FOUND, f"Job {job_id} has {row.grasps or 0} grasps, and no rank {rank}.")
    path = runtime.storage.picture(job_id, rank)
    if not path.exists():
        deadline = runtime.settings.picture_deadline_s
        await runtime.engine.answer(
            runtime.tasks.draw, runtime.storage, job_id, row.object_id, rank, deadline_s=deadline
        )
    return _PngResponse(path)


def _check(runtime: Runtime, asked: JobCreate) -> None:
    """Refuse what the planner would refuse, while there is somebody to tell."""
    hands = [hand.name for hand in runtime.hands()]
    if asked.hand not in hands:
        detail = f"Unknown hand {asked.hand!r}; known hands: {', '.join(hands)}."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/hand", valid=hands)
    try:
        PlannerSettings.from_document(asked.planner)
    except SettingsError as error:
        raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field="/planner") from error
    for index, grasp in enumerate(asked.parallel_grasps or []):
        try:
            ParallelGrasp.from_document(grasp.model_dump())
        except ParallelGraspError as error:
            field = f"/parallel_grasps/{index}"
            raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field=field) from error


async def _known_job(runtime: Runtime, job_id: str) -> JobRow:
    row = await runtime.store.job(job_id)
    if row is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is no job {job_id!r}.")
    return row


def _summary(runtime: Runtime, row: JobRow) -> JobSummary:
    """A job as the table has it, with what only a running one has."""
    running = runtime.dispatcher.progress(row.id) if row.state == "running" else None
    return JobSummary(
        id=row.id,
        state=row.state,
        stage=running.stage if running else None,
        progress=running.share if running else float(row.state == "succeeded"),
        created_at=_time(row.created_at),
        started_at=_time(row.started_at),
        finished_at=_time(row.finished_at),
        request=JobCreate.model_validate_json(row.request),
        error=row.error,
    )


def _time(seconds: float | None) -> Any:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


def _with_result(summary: JobSummary, result: str | None) -> str:
    """The ``Job`` document. A result is text already; parsing it would cost the event loop."""
    return f'{summary.model_dump_json()[:-1]},"result":{result or "null"}}}'


def _json(document: str, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    return Response(document, status, headers, media_type="application/json")
