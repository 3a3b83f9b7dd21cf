"""What people look at of a grasp: pictures, recordings and the curve of its quality, made when first asked for."""

from pathlib import Path
from typing import Any, TypeVar

from fastapi import APIRouter
from fastapi.responses import FileResponse

from fingersplit_client.schemas import GraspCurve
from fingersplit_service.dependencies import Results
from fingersplit_service.endpoints.documents import JobId, Rank
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

_JOB = "/v1/jobs/{job_id}"
_GRASP = _JOB + "/grasps/{rank}"
_PROBLEMS = problem_answers(
    ProblemKind.NOT_FOUND,
    ProblemKind.NOT_FINISHED,
    ProblemKind.GONE,
    ProblemKind.INVALID_REQUEST,
    ProblemKind.WORKER_FAILED,
)
router = APIRouter(tags=["jobs"], responses=_PROBLEMS)


class _PngResponse(FileResponse):
    """A PNG file."""

    media_type = "image/png"


class _WebpResponse(FileResponse):
    """A WebP file."""

    media_type = "image/webp"


class _RecordingResponse(FileResponse):
    """A rerun recording."""

    media_type = "application/vnd.rerun.rrd"


class _CurveResponse(FileResponse):
    """A JSON file."""

    media_type = "application/json"


@router.get(_GRASP + "/picture.png", response_class=_PngResponse, summary="See a grasp")
async def get_picture(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> _PngResponse:
    """Hand and object at the start and at the end, beside the quality curve."""
    return _kept(_PngResponse, await results.view(principal.owner, job_id, rank, "picture.png"))


@router.get(_GRASP + "/animation.webp", response_class=_WebpResponse, summary="See how a grasp came about")
async def get_animation(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> _WebpResponse:
    """A small moving picture of the search, from the mapped start to the grasp."""
    return _kept(_WebpResponse, await results.view(principal.owner, job_id, rank, "animation.webp"))


@router.get(_GRASP + "/recording.rrd", response_class=_RecordingResponse, summary="Get a grasp's recording")
async def get_recording(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> _RecordingResponse:
    """What happened from start to end, for the rerun viewer."""
    return _kept(_RecordingResponse, await results.view(principal.owner, job_id, rank, "recording.rrd"))


@router.get(_JOB + "/recording.rrd", response_class=_RecordingResponse, summary="Get a job's recording")
async def get_job_recording(results: Results, principal: Reader, job_id: JobId) -> _RecordingResponse:
    """The recording of the best grasp: the first that held in simulation, else the one of rank 1."""
    return _kept(_RecordingResponse, await results.view(principal.owner, job_id, None, "recording.rrd"))


@router.get(_JOB + "/thumbnail.webp", response_class=_WebpResponse, summary="See a job's best grasp, small")
async def get_thumbnail(results: Results, principal: Reader, job_id: JobId) -> _WebpResponse:
    """The best grasp as in the job's recording, on a transparent ground."""
    return _kept(_WebpResponse, await results.view(principal.owner, job_id, None, "thumbnail.webp"))


@router.get(_GRASP + "/curve", response_model=GraspCurve, summary="Get a grasp's quality curve")
async def get_curve(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> FileResponse:
    """Quality and gaps over the accepted states of the search."""
    return _kept(_CurveResponse, await results.view(principal.owner, job_id, rank, "curve.json"))


@router.get(_GRASP + "/scene", response_model=dict[str, Any], summary="Get a grasp to draw")
async def get_scene(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> FileResponse:
    """Hand, object, search, contacts, forces, approach and surroundings, as the pages draw them in three dimensions."""
    return _compressed(await results.view(principal.owner, job_id, rank, "scene.json.gz"))


@router.get(_GRASP + "/motion", response_model=dict[str, Any], summary="Get a grasp's simulation to draw")
async def get_motion(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> FileResponse:
    """Palm, joints, object and forces of the simulation that verified a grasp; no times where there was none."""
    return _compressed(await results.view(principal.owner, job_id, rank, "motion.json.gz"))


@router.get(_JOB + "/starts", response_model=dict[str, Any], summary="See how each start ended")
async def get_starts(results: Results, principal: Reader, job_id: JobId) -> FileResponse:
    """Hand and object, and for every start of the search where it ended and why, as the pages draw them."""
    return _compressed(await results.starts(principal.owner, job_id))


_File = TypeVar("_File", bound=FileResponse)


def _kept(kind: type[_File], path: Path) -> _File:
    """A file that a browser may keep: what is made of a finished run does not change."""
    return kind(path, headers={"Cache-Control": "private, max-age=86400"}, media_type=kind.media_type)


def _compressed(path: Path) -> FileResponse:
    """A compressed file; motions of a run that is verified later change once, so they are asked for again."""
    headers = {"Cache-Control": "private, no-cache", "Content-Encoding": "gzip"}
    return FileResponse(path, headers=headers, media_type="application/json")
