"""What a job found: its grasps, their verification, pictures and recordings."""

import json
from typing import Any

from fastapi import APIRouter, Response
from fastapi.responses import FileResponse

from fingersplit_client.schemas import Grasp, GraspVerification, JobVerification
from fingersplit_service.endpoints.documents import JobId, Rank, json_response, known_job
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency
from fingersplit_service.security.access import Principal, Reader

__all__ = ["router"]

_JOB = "/v1/jobs/{job_id}"
router = APIRouter(tags=["jobs"])
_PROBLEMS = problem_answers(ProblemKind.NOT_FOUND, ProblemKind.NOT_FINISHED, ProblemKind.INVALID_REQUEST)


class _PngResponse(FileResponse):
    """A PNG file."""

    media_type = "image/png"


class _RecordingResponse(FileResponse):
    """A Rerun recording."""

    media_type = "application/vnd.rerun.rrd"


@router.get(_JOB + "/grasps", response_model=list[Grasp], summary="List a job's grasps", responses=_PROBLEMS)
async def list_grasps(runtime: RuntimeDependency, principal: Reader, job_id: JobId) -> Response:
    """The ranked grasps, best first; none for a job that failed or was cancelled."""
    return json_response(json.dumps(await _grasps(runtime, principal, job_id)))


@router.get(_JOB + "/grasps/{rank}", response_model=Grasp, summary="Get a grasp", responses=_PROBLEMS)
async def get_grasp(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> Response:
    """One ranked grasp."""
    return json_response(json.dumps(await _grasp(runtime, principal, job_id, rank)))


@router.get(_JOB + "/verification", summary="See what simulation showed", responses=_PROBLEMS)
async def get_verification(runtime: RuntimeDependency, principal: Reader, job_id: JobId) -> JobVerification:
    """The report of every grasp that was simulated."""
    row, _ = await known_job(runtime, principal, job_id)
    grasps = await _grasps(runtime, principal, job_id)
    return JobVerification(
        asked=json.loads(row.request)["verified"],
        verified=row.verified or 0,
        grasps=[
            GraspVerification(rank=grasp["rank"], verification=grasp["verification"])
            for grasp in grasps
            if grasp["verification"] is not None
        ],
    )


@router.get(
    _JOB + "/grasps/{rank}/picture.png",
    response_class=_PngResponse,
    summary="See a grasp",
    responses=_PROBLEMS | problem_answers(ProblemKind.NOT_FINISHED, ProblemKind.GONE, ProblemKind.WORKER_FAILED),
)
async def get_picture(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> _PngResponse:
    """Hand and object at the start and at the end, beside the quality curve. Drawn when first asked for."""
    await _grasp(runtime, principal, job_id, rank)
    row, _ = await known_job(runtime, principal, job_id)
    path = runtime.storage.picture(job_id, rank)
    if not path.exists():
        for needed in (runtime.storage.mesh(row.object_id), runtime.storage.traces(job_id)):
            if not needed.exists():
                detail = "The picture cannot be drawn: the object or the record of the search is not kept any more."
                raise ProblemError(ProblemKind.GONE, detail)
        await runtime.engine.answer(
            runtime.tasks.draw,
            runtime.storage,
            job_id,
            row.object_id,
            rank,
            deadline_s=runtime.settings.picture_deadline_s,
        )
    return _PngResponse(path)


@router.get(
    _JOB + "/grasps/{rank}/recording.rrd",
    response_class=_RecordingResponse,
    summary="Get a grasp's recording",
    responses=_PROBLEMS,
)
async def get_recording(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> _RecordingResponse:
    """What happened from start to end, for the Rerun viewer."""
    await _grasp(runtime, principal, job_id, rank)
    path = runtime.storage.recording(job_id, rank)
    if not path.exists():
        raise ProblemError(ProblemKind.NOT_FOUND, f"No recording of grasp {rank} of job {job_id} is kept.")
    return _RecordingResponse(path, media_type=_RecordingResponse.media_type)


async def _grasps(runtime: Runtime, principal: Principal, job_id: str) -> list[dict[str, Any]]:
    row, result = await known_job(runtime, principal, job_id)
    if not row.ended:
        raise ProblemError(ProblemKind.NOT_FINISHED, f"Job {job_id} is {row.state}; grasps come with its result.")
    grasps: list[dict[str, Any]] = json.loads(result)["grasps"] if result else []
    return grasps


async def _grasp(runtime: Runtime, principal: Principal, job_id: str, rank: int) -> dict[str, Any]:
    grasps = await _grasps(runtime, principal, job_id)
    for grasp in grasps:
        if grasp["rank"] == rank:
            return grasp
    raise ProblemError(ProblemKind.NOT_FOUND, f"Job {job_id} has {len(grasps)} grasps, and no rank {rank}.")
