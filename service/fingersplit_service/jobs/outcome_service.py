"""What became of planned grasps on robots: kept, listed, exported, and compared with what was predicted."""

import csv
import io
import json
import math
from collections.abc import AsyncIterator
from datetime import UTC, datetime
from secrets import token_hex
from typing import Any

from fingersplit_client.schemas import GraspOutcome, OutcomeBin, OutcomeCreate, OutcomeSummary
from fingersplit_service.database.outcomes import OutcomeFilter, OutcomeStore, Prediction
from fingersplit_service.jobs.errors import InvalidField, NotFound
from fingersplit_service.jobs.job_service import JobService
from fingersplit_service.jobs.result_service import ResultService

__all__ = ["OutcomeService"]

BINS = 10
_AT_ONCE = 500
_KEPT = {"palm", "joints", "squeeze_joints", "contacts", "metrics"}  # of the planned grasp
_COLUMNS = (
    *("id", "created_at", "job_id", "rank", "object_id", "object_name", "hand", "held", "p_hold", "p_hold_tier"),
    *("error_x", "error_y", "error_z", "error_qw", "error_qx", "error_qy", "error_qz", "note"),
)


class OutcomeService:
    """What can be done with outcomes; every method acts for one owner.

    Args:
        store: Where they are kept.
        jobs: The jobs that planned the grasps.
        results: What these found.
    """

    def __init__(self, store: OutcomeStore, jobs: JobService, results: ResultService) -> None:
        self._store, self._jobs, self._results = store, jobs, results

    async def report(self, owner: str, job_id: str, rank: int, reported: OutcomeCreate) -> GraspOutcome:
        """Keep what became of a grasp. A grasp may have many outcomes, one for each time it was tried.

        Raises:
            NotFound: The owner has no such job, or the job no such grasp.
            NotFinished: The job has not ended.
            ResourceGone: Its result is of another version.
            InvalidField: The measured turn is no rotation.
        """
        grasp = await self._results.grasp(owner, job_id, rank)
        job = (await self._jobs.get(owner, job_id)).row
        predicted = grasp.p_hold
        outcome = GraspOutcome(
            **_normalized(reported).model_dump(),
            id=token_hex(16),
            job_id=job_id,
            rank=rank,
            object_id=job.object_id,
            object_name=job.object_name,
            hand=job.hand,
            p_hold=None if predicted is None else predicted.value,
            p_hold_tier=None if predicted is None else predicted.tier,
            created_at=datetime.now(UTC),
        )
        await self._store.add(owner, outcome, grasp.model_dump_json(include=_KEPT, exclude_unset=True))
        return outcome

    async def page(
        self, owner: str, which: OutcomeFilter, before: int | None, limit: int
    ) -> tuple[list[GraspOutcome], list[int]]:
        """Outcomes, newest first, and their places in the list."""
        found = await self._store.page(owner, which, before, limit)
        return [GraspOutcome.model_validate_json(one.document) for one in found], [one.number for one in found]

    async def of_job(self, owner: str, job_id: str, rank: int) -> list[GraspOutcome]:
        """The outcomes of one grasp, newest first; also of a job that was deleted.

        Raises:
            NotFound: The owner has no such job, and no outcome of it.
        """
        outcomes, _ = await self.page(owner, OutcomeFilter(job_id=job_id, rank=rank), None, 10_000)
        if not outcomes:
            await self._jobs.get(owner, job_id)
        return outcomes

    async def delete(self, owner: str, outcome_id: str) -> None:
        """Forget an outcome, such as one that was reported by mistake.

        Raises:
            NotFound: The owner has no such outcome.
        """
        if not await self._store.delete(owner, outcome_id):
            raise NotFound(f"There is no outcome {outcome_id}.")

    async def summary(self, owner: str, which: OutcomeFilter) -> OutcomeSummary:
        """How predictions and outcomes compare."""
        return _summarize(await self._store.predictions(owner, which))

    async def lines(self, owner: str, which: OutcomeFilter, *, as_csv: bool) -> AsyncIterator[str]:
        """All outcomes, newest first: a JSON document a line with the planned grasp, or rows of a table."""
        if as_csv:
            yield _row(_COLUMNS)
        before: int | None = None
        while found := await self._store.page(owner, which, before, _AT_ONCE):
            for one in found:
                document: dict[str, Any] = json.loads(one.document)
                yield (
                    _row(_cells(document)) if as_csv else json.dumps(document | {"grasp": json.loads(one.grasp)}) + "\n"
                )
            before = found[-1].number


def _normalized(reported: OutcomeCreate) -> OutcomeCreate:
    """The same with a unit quaternion."""
    if reported.pose_error is None:
        return reported
    length = math.hypot(*reported.pose_error.wxyz)
    if not (math.isfinite(length) and length > 1e-6):
        raise InvalidField("/pose_error/wxyz", "The quaternion has no direction; give (w, x, y, z) of a rotation.")
    w, x, y, z = (part / length for part in reported.pose_error.wxyz)
    return reported.model_copy(update={"pose_error": reported.pose_error.model_copy(update={"wxyz": (w, x, y, z)})})


def _summarize(found: list[Prediction] | Any) -> OutcomeSummary:
    known = [(one.p_hold, one.held) for one in found if one.p_hold is not None]
    bins, error = [], 0.0
    for number in range(BINS):
        inside = [(p, held) for p, held in known if min(int(p * BINS), BINS - 1) == number]
        predicted = sum(p for p, _ in inside) / len(inside) if inside else None
        share = sum(held for _, held in inside) / len(inside) if inside else None
        if predicted is not None and share is not None:
            error += abs(predicted - share) * len(inside) / len(known)
        bins.append(
            OutcomeBin(
                low=number / BINS, high=(number + 1) / BINS, outcomes=len(inside), predicted=predicted, held=share
            )
        )
    return OutcomeSummary(
        outcomes=len(found),
        held=sum(one.held for one in found),
        predicted=len(known),
        brier_score=sum((p - held) ** 2 for p, held in known) / len(known) if known else None,
        calibration_error=error if known else None,
        bins=bins,
    )


def _cells(document: dict[str, Any]) -> list[Any]:
    error = document["pose_error"]
    measured = [None] * 7 if error is None else [*error["position"], *error["wxyz"]]
    note = document["note"]
    # A spreadsheet would run what begins like this.
    safe = f"'{note}" if note[:1] in {"=", "+", "-", "@", "\t", "\r"} else note
    return [*(document[name] for name in _COLUMNS[:10]), *measured, safe]


def _row(cells: Any) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()
