"""Jobs as the table has them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa

from fingersplit_client.schemas import JobError, JobState, VerificationState
from fingersplit_service.database.tables import jobs

__all__ = ["LISTED_COLUMNS", "JobRow", "NewJob", "job_row", "one_job"]


@dataclass(frozen=True, slots=True)
class JobRow:
    """A job without its result. ``request`` is JSON text, and empty in lists; times are seconds since 1970, UTC."""

    number: int
    id: str
    owner: str
    object_id: str
    object_name: str
    hand: str
    batch_id: str | None
    state: JobState
    priority: int
    deadline_s: float | None
    attempts: int
    created_at: float
    started_at: float | None
    finished_at: float | None
    grasps: int | None
    feasible: int | None
    verified: int | None
    holding_margin: float | None
    verification: VerificationState | None
    runner: str | None
    stage: str | None
    progress: float | None
    error: JobError | None
    warnings: list[str]
    request: str = ""

    @property
    def ended(self) -> bool:
        """Whether it has reached a final state."""
        return self.state not in ("queued", "running")


@dataclass(frozen=True)
class NewJob:
    """A job to be accepted: its id, and what was asked for as JSON text and as columns."""

    id: str
    object_id: str
    hand: str
    priority: int
    deadline_s: float | None
    request: str
    request_hash: str


_NOT_A_COLUMN = {"error", "warnings", "request"}
LISTED_COLUMNS = [
    *(jobs.c[name] for name in JobRow.__slots__ if name not in _NOT_A_COLUMN),
    jobs.c.error_code,
    jobs.c.error_detail,
    jobs.c.warnings,
]
"""The columns of a `JobRow`, without its request."""


def job_row(row: Mapping[Any, Any]) -> JobRow:
    """A row of `LISTED_COLUMNS`, perhaps with the request."""
    columns: dict[str, Any] = dict(row)
    code, detail, warnings = (columns.pop(name) for name in ("error_code", "error_detail", "warnings"))
    error = None if code is None else JobError(code=code, detail=detail)
    return JobRow(error=error, warnings=[] if warnings == "[]" else json.loads(warnings), **columns)


def one_job(connection: sa.Connection, which: sa.ColumnElement[bool]) -> JobRow | None:
    """The job that a condition names, with its request."""
    row = connection.execute(sa.select(*LISTED_COLUMNS, jobs.c.request).where(which)).mappings().one_or_none()
    return None if row is None else job_row(row)
