"""What a job found: its grasps and their verification."""

import json

from fastapi import APIRouter, Response
from pydantic import TypeAdapter

from fingersplit_client.schemas import Grasp, GraspVerification, JobVerification
from fingersplit_service.dependencies import Jobs, Results
from fingersplit_service.endpoints.documents import JobId, Rank, json_response
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Reader

__all__ = ["router"]

_JOB = "/v1/jobs/{job_id}"
router = APIRouter(tags=["jobs"])
_PROBLEMS = problem_answers(
    ProblemKind.NOT_FOUND, ProblemKind.NOT_FINISHED, ProblemKind.GONE, ProblemKind.INVALID_REQUEST
)
_GRASPS = TypeAdapter(list[Grasp])


@router.get(_JOB + "/grasps", response_model=list[Grasp], summary="List a job's grasps", responses=_PROBLEMS)
async def list_grasps(results: Results, principal: Reader, job_id: JobId) -> Response:
    """The ranked grasps, best first; none for a job that failed or was cancelled."""
    return json_response(_GRASPS.dump_json(await results.grasps(principal.owner, job_id), exclude_unset=True).decode())


@router.get(_JOB + "/grasps/{rank}", response_model=Grasp, summary="Get a grasp", responses=_PROBLEMS)
async def get_grasp(results: Results, principal: Reader, job_id: JobId, rank: Rank) -> Response:
    """One ranked grasp."""
    return json_response((await results.grasp(principal.owner, job_id, rank)).model_dump_json(exclude_unset=True))


@router.get(_JOB + "/verification", summary="See what simulation showed", responses=_PROBLEMS)
async def get_verification(jobs: Jobs, results: Results, principal: Reader, job_id: JobId) -> JobVerification:
    """The report of every grasp that was simulated."""
    grasps = await results.grasps(principal.owner, job_id)
    job = await jobs.get(principal.owner, job_id)
    return JobVerification(
        asked=json.loads(job.row.request)["verified"],
        verified=job.row.verified or 0,
        grasps=[
            GraspVerification(rank=grasp.rank, verification=grasp.verification, initial=grasp.initial.verification)
            for grasp in grasps
            if grasp.verification is not None
        ],
    )
