"""Outcomes: what became of planned grasps on robots."""

from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Path, Query
from fastapi.responses import StreamingResponse

from fingersplit_client.schemas import GraspOutcome, OutcomeCreate, OutcomePage, OutcomeSummary
from fingersplit_service.database.outcomes import OutcomeFilter
from fingersplit_service.dependencies import Outcomes
from fingersplit_service.endpoints.documents import ID_PATTERN, Cursor, JobId, Limit, next_cursor, place
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/outcomes"
_GRASP = "/v1/jobs/{job_id}/grasps/{rank}"
router = APIRouter(tags=["outcomes"])

Rank = Annotated[int, Path(description="Rank of the grasp, from 1.", le=2_147_483_647)]
_Id = Annotated[str, Query(max_length=64)]


def _filter(
    job_id: Annotated[str | None, Query(max_length=64, description="Only outcomes of this job.")] = None,
    object_id: Annotated[str | None, Query(max_length=64, description="Only outcomes with this object.")] = None,
    hand: Annotated[str | None, Query(max_length=64, description="Only outcomes with this hand.")] = None,
) -> OutcomeFilter:
    return OutcomeFilter(job_id, object_id, hand)


Filter = Annotated[OutcomeFilter, Depends(_filter)]
OutcomeId = Annotated[str, Path(description="Id of an outcome.", max_length=64, pattern=ID_PATTERN)]


@router.post(
    _GRASP + "/outcome",
    status_code=201,
    summary="Report what became of a grasp",
    responses=problem_answers(
        ProblemKind.NOT_FOUND, ProblemKind.NOT_FINISHED, ProblemKind.GONE, ProblemKind.INVALID_REQUEST
    ),
)
async def report_outcome(
    outcomes: Outcomes, principal: Planner, job_id: JobId, rank: Rank, reported: OutcomeCreate
) -> GraspOutcome:
    """Whether a grasp held on a robot, and how far the object was from its planned pose.

    Report every attempt, also those that went well. Outcomes are kept when their job is deleted.
    """
    return await outcomes.report(principal.owner, job_id, rank, reported)


@router.get(
    _GRASP + "/outcomes",
    summary="List what became of a grasp",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def list_outcomes_of_grasp(
    outcomes: Outcomes, principal: Reader, job_id: JobId, rank: Rank
) -> list[GraspOutcome]:
    """Every reported outcome of one grasp, newest first; also when its job was deleted since."""
    return await outcomes.of_job(principal.owner, job_id, rank)


@router.get(PATH, summary="List outcomes", responses=problem_answers(ProblemKind.INVALID_REQUEST))
async def list_outcomes(
    outcomes: Outcomes, principal: Reader, which: Filter, limit: Limit = 100, cursor: Cursor = None
) -> OutcomePage:
    """Reported outcomes, newest first, with the probability of holding that was predicted."""
    items, numbers = await outcomes.page(principal.owner, which, place(cursor), limit)
    return OutcomePage(items=items, next_cursor=next_cursor(numbers, limit))


@router.get(
    PATH + "/summary",
    summary="Compare outcomes with predictions",
    responses=problem_answers(ProblemKind.INVALID_REQUEST),
)
async def summarize_outcomes(outcomes: Outcomes, principal: Reader, which: Filter) -> OutcomeSummary:
    """Outcomes by predicted probability of holding, with Brier score and calibration error."""
    return await outcomes.summary(principal.owner, which)


@router.get(
    PATH + "/export",
    summary="Get all outcomes as a file",
    response_class=StreamingResponse,
    responses=problem_answers(ProblemKind.INVALID_REQUEST),
)
async def export_outcomes(
    outcomes: Outcomes,
    principal: Reader,
    which: Filter,
    file_format: Annotated[
        Literal["csv", "jsonl"],
        Query(description="`csv` for a table, `jsonl` for a document a line with the planned grasp."),
    ] = "jsonl",
) -> StreamingResponse:
    """Every outcome, newest first, for fitting models of one's own."""
    lines = outcomes.lines(principal.owner, which, as_csv=file_format == "csv")
    media_type = "text/csv" if file_format == "csv" else "application/jsonl"
    headers = {"Content-Disposition": f'attachment; filename="outcomes.{file_format}"'}
    return StreamingResponse(lines, headers=headers, media_type=media_type)


@router.delete(
    PATH + "/{outcome_id}",
    status_code=204,
    summary="Delete an outcome",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def delete_outcome(outcomes: Outcomes, principal: Planner, outcome_id: OutcomeId) -> None:
    """Forget an outcome, such as one that was reported by mistake."""
    await outcomes.delete(principal.owner, outcome_id)
