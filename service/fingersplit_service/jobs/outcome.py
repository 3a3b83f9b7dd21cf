"""What a job ended with, written and read; apart from everything else, so that a worker loads no database for it."""

import json
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError
from pydantic_core import to_json

from fingersplit.errors import ResultError
from fingersplit_client.schemas import Grasp, PlanResult
from fingersplit_service.database.result_row import JobResultRow

__all__ = ["JobOutcome", "read_grasps", "strict_json"]


@dataclass(frozen=True)
class JobOutcome:
    """A finished job.

    Attributes:
        row: What to keep.
        stage_ms: Time by stage [ms], for the metrics.
        simulated: Whether each simulated grasp held, for the metrics.
        best_rank: Rank of the grasp that stands for the run in lists; None when there is no grasp.
    """

    row: JobResultRow
    stage_ms: dict[str, float] = field(default_factory=dict)
    simulated: tuple[bool, ...] = ()
    best_rank: int | None = None


def read_grasps(result: str | None) -> list[Grasp]:
    """The grasps of a result document, JSON, best first; none where there is no result.

    For the process that does not load the planner; workers read ``fingersplit.result.PlanResult``.

    Raises:
        ResultError: The result is of another version.
    """
    if result is None:
        return []
    try:
        return PlanResult.model_validate_json(result).grasps
    except ValidationError as error:
        raise ResultError("The result was stored by another version of Fingersplit; plan again.") from error


def strict_json(document: dict[str, Any]) -> str:
    """A document as compact JSON; a number that JSON does not have raises ``ValueError``."""
    text = to_json(document)  # six times as fast as the standard library, but not strict
    if b"NaN" in text or b"Infinity" in text:
        return json.dumps(document, allow_nan=False, separators=(",", ":"))
    return text.decode()
