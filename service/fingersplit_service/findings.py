"""What a job found; apart from everything else, so that a worker does not load the database for it."""

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Finding"]


@dataclass(frozen=True)
class Finding:
    """What a job found: the result document, JSON, its summary, and what went wrong beside it."""

    result: str
    grasps: int
    feasible: int
    verified: int
    holding_margin: float | None
    warnings: Sequence[str] = ()
