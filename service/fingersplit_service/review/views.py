"""What people look at of a grasp: pictures, recordings and the curve of its quality, made when first asked for.

Making them on demand keeps them off the way of a job's answer, and only runs that somebody looks at take space. Small
pictures for the lists alone are made in advance, by a worker that has nothing else to do.
"""

import asyncio
import json
from pathlib import Path
from typing import TypeVar

from fastapi import APIRouter
from fastapi.responses import FileResponse

from fingersplit.recording.traces_file import load_run
from fingersplit_client.schemas import GraspCurve
from fingersplit_service.endpoints.documents import JobId, Rank, known_job
from fingersplit_service.endpoints.grasps import job_grasp, job_grasps
from fingersplit_service.jobs.views import ViewName, ViewOrder, best_rank
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency
from fingersplit_service.security.access import Principal, Reader

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
_OBJECTIVE = 0  # column of Q in a trace's scores
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


@router.get(_GRASP + "/picture.png", response_class=_PngResponse, summary="See a grasp")
async def get_picture(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> _PngResponse:
    """Hand and object at the start and at the end, beside the quality curve."""
    return _kept(_PngResponse, await _view(runtime, principal, job_id, rank, "picture.png"))


@router.get(_GRASP + "/animation.webp", response_class=_WebpResponse, summary="See how a grasp came about")
async def get_animation(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> _WebpResponse:
    """A small moving picture of the search, from the mapped start to the grasp."""
    return _kept(_WebpResponse, await _view(runtime, principal, job_id, rank, "animation.webp"))


@router.get(_GRASP + "/recording.rrd", response_class=_RecordingResponse, summary="Get a grasp's recording")
async def get_recording(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> _RecordingResponse:
    """What happened from start to end, for the rerun viewer."""
    return _kept(_RecordingResponse, await _view(runtime, principal, job_id, rank, "recording.rrd"))


@router.get(_JOB + "/recording.rrd", response_class=_RecordingResponse, summary="Get a job's recording")
async def get_job_recording(runtime: RuntimeDependency, principal: Reader, job_id: JobId) -> _RecordingResponse:
    """The recording of the best grasp: the first that held in simulation, else the one of rank 1."""
    rank = await _best_rank(runtime, principal, job_id)
    return _kept(_RecordingResponse, await _view(runtime, principal, job_id, rank, "recording.rrd"))


@router.get(_JOB + "/thumbnail.webp", response_class=_WebpResponse, summary="See a job's best grasp, small")
async def get_thumbnail(runtime: RuntimeDependency, principal: Reader, job_id: JobId) -> _WebpResponse:
    """The best grasp as in the job's recording, on a transparent ground."""
    rank = await _best_rank(runtime, principal, job_id)
    return _kept(_WebpResponse, await _view(runtime, principal, job_id, rank, "thumbnail.webp"))


@router.get(_GRASP + "/curve", summary="Get a grasp's quality curve")
async def get_curve(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> GraspCurve:
    """Quality and gaps over the accepted states of the search."""
    order = await _order(runtime, principal, job_id, rank, "recording.rrd")
    _check_possible(runtime, order)
    return await asyncio.to_thread(_read_curve, runtime.storage.traces(job_id), rank)


_File = TypeVar("_File", bound=FileResponse)


def _kept(kind: type[_File], path: Path) -> _File:
    """A file that a browser may keep: what was made of a finished run does not change."""
    return kind(path, headers={"Cache-Control": "private, max-age=86400"}, media_type=kind.media_type)


def _read_curve(traces: Path, rank: int) -> GraspCurve:
    run = load_run(traces, rank)
    return GraspCurve(
        phases=[run.phase_names[phase] for phase in run.trace["phases"]],
        quality=run.trace["scores"][:, _OBJECTIVE].tolist(),
        residual=run.trace["residuals"].max(axis=1).tolist(),
    )


async def _best_rank(runtime: Runtime, principal: Principal, job_id: str) -> int:
    rank = best_rank(await job_grasps(runtime, principal, job_id))
    if rank is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"Job {job_id} found no grasp to look at.")
    return rank


async def _view(runtime: Runtime, principal: Principal, job_id: str, rank: int, name: ViewName) -> Path:
    """The file of a view, made by a worker unless it is there."""
    order = await _order(runtime, principal, job_id, rank, name)
    path = runtime.storage.view(job_id, rank, name)
    if not path.exists():
        _check_possible(runtime, order)
        deadline = runtime.settings.picture_deadline_s
        await runtime.engine.answer(runtime.tasks.draw, runtime.storage, order, deadline_s=deadline)
    return path


async def _order(runtime: Runtime, principal: Principal, job_id: str, rank: int, name: ViewName) -> ViewOrder:
    await job_grasp(runtime, principal, job_id, rank)
    row, _ = await known_job(runtime, principal, job_id)
    await runtime.dispatcher.released(job_id)  # which may still record it
    friction = json.loads(row.request)["planner"].get("friction")
    return ViewOrder(name, job_id, rank, row.object_id, row.object_name, friction)


def _check_possible(runtime: Runtime, order: ViewOrder) -> None:
    for needed in (runtime.storage.shape(order.object_id), runtime.storage.traces(order.job_id)):
        if not needed.exists():
            detail = "It cannot be made: the object or the record of the search is not kept any more."
            raise ProblemError(ProblemKind.GONE, detail)
