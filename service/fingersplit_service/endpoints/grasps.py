"""What a job found: its grasps and their verification."""

import json
from typing import Any

from fastapi import APIRouter, Response

from fingersplit_client.schemas import Grasp, GraspVerification, JobVerification
from fingersplit_service.endpoints.documents import JobId, Rank, json_response, known_job
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency
from fingersplit_service.security.access import Principal, Reader

__all__ = ["job_grasp", "job_grasps", "router"]

_JOB = "/v1/jobs/{job_id}"
router = APIRouter(tags=["jobs"])
_PROBLEMS = problem_answers(ProblemKind.NOT_FOUND, ProblemKind.NOT_FINISHED, ProblemKind.INVALID_REQUEST)


@router.get(_JOB + "/grasps", response_model=list[Grasp], summary="List a job's grasps", responses=_PROBLEMS)
async def list_grasps(runtime: RuntimeDependency, principal: Reader, job_id: JobId) -> Response:
    """The ranked grasps, best first; none for a job that failed or was cancelled."""
    return json_response(json.dumps(await job_grasps(runtime, principal, job_id)))


@router.get(_JOB + "/grasps/{rank}", response_model=Grasp, summary="Get a grasp", responses=_PROBLEMS)
async def get_grasp(runtime: RuntimeDependency, principal: Reader, job_id: JobId, rank: Rank) -> Response:
    """One ranked grasp."""
    return json_response(json.dumps(await job_grasp(runtime, principal, job_id, rank)))


@router.get(_JOB + "/verification", summary="See what simulation showed", responses=_PROBLEMS)
async def get_verification(runtime: RuntimeDependency, principal: Reader, job_id: JobId) -> JobVerification:
    """The report of every grasp that was simulated."""
    row, _ = await known_job(runtime, principal, job_id)
    grasps = await job_grasps(runtime, principal, job_id)
    return JobVerification(
        asked=json.loads(row.request)["verified"],
        verified=row.verified or 0,
        grasps=[
            GraspVerification.model_validate(
                {
                    "rank": grasp["rank"],
                    "verification": grasp["verification"],
                    "initial": grasp["initial"].get("verification"),
                }
            )
            for grasp in grasps
            if grasp["verification"] is not None
        ],
    )


async def job_grasps(runtime: Runtime, principal: Principal, job_id: str) -> list[dict[str, Any]]:
    """The documents of a job's grasps.

    Raises:
        ProblemError: Whoever asks has no such job, or it has not ended.
    """
    row, result = await known_job(runtime, principal, job_id)
    if not row.ended:
        raise ProblemError(ProblemKind.NOT_FINISHED, f"Job {job_id} is {row.state}; grasps come with its result.")
    grasps: list[dict[str, Any]] = json.loads(result)["grasps"] if result else []
    return grasps


async def job_grasp(runtime: Runtime, principal: Principal, job_id: str, rank: int) -> dict[str, Any]:
    """The document of one grasp.

    Raises:
        ProblemError: As ``job_grasps``, or there is no such rank.
    """
    grasps = await job_grasps(runtime, principal, job_id)
    for grasp in grasps:
        if grasp["rank"] == rank:
            return grasp
    raise ProblemError(ProblemKind.NOT_FOUND, f"Job {job_id} has {len(grasps)} grasps, and no rank {rank}.")
