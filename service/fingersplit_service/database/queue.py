"""The queue inside the job table: who is next, and what became of it.

Each change of a job's state is one ``UPDATE ... WHERE state = ... RETURNING``: no two hands move one job. A running job
is leased to one service process, which extends the lease while it lives.
"""

import json
import time
from collections.abc import Sequence
from typing import Any

import sqlalchemy as sa

from fingersplit_client.schemas import JobError
from fingersplit_service.database.connection import Database, Store, transaction
from fingersplit_service.database.rows import LISTED_COLUMNS, JobRow, job_row
from fingersplit_service.database.tables import jobs, results
from fingersplit_service.findings import Finding

__all__ = ["Queue"]

_MAX_WORKER_DEATHS = 2
_MAX_ATTEMPTS = 10  # a job under which the whole service dies each time must not be taken up for ever

# Statements of every job's way are built once: building one takes longer than SQLite does to run it.
_WAITING = (
    sa.select(jobs.c.priority, jobs.c.owner, sa.func.min(jobs.c.number), sa.func.count())
    .where(jobs.c.state == "queued")
    .group_by(jobs.c.priority, jobs.c.owner)
)
_RUNNING = sa.select(jobs.c.owner, sa.func.count()).where(jobs.c.state == "running").group_by(jobs.c.owner)
_CLAIM = (
    sa.update(jobs)
    .where(jobs.c.number == sa.bindparam("next_job"), jobs.c.state == "queued")
    .values(state="running", attempts=jobs.c.attempts + 1)  # and what else is given
    .returning(*LISTED_COLUMNS, jobs.c.request)
)
_SUCCEED = (
    sa.update(jobs)
    .where(jobs.c.id == sa.bindparam("job_id"), jobs.c.runner == sa.bindparam("mine"), jobs.c.state == "running")
    .values(state="succeeded", lease_until=None)  # and what else is given
    .returning(*LISTED_COLUMNS, jobs.c.request)
)
_KEEP = sa.insert(results)


class Queue(Store):
    """Jobs as their runner sees them.

    Args:
        database: Where they are.
        runner: Name of this service process.
        lease_s: How long a job stays with a process that does not say that it lives [s].

    Attributes:
        more: Whether jobs were left in the queue when one was claimed last.
    """

    def __init__(self, database: Database, runner: str, lease_s: float) -> None:
        super().__init__(database)
        self._runner, self._lease_s = runner, lease_s
        self.more = False
        self._served: dict[str, int] = {}
        self._turns = 0

    @transaction
    def claim(self, connection: sa.Connection) -> JobRow | None:
        """Take a job for a worker, counting the attempt before it begins.

        The highest priority goes first; within it the owner with the fewest running jobs, of these the one that was
        served least recently, and of that owner's jobs the oldest.
        """
        next_job = self._next(connection)
        if next_job is None:
            return None
        now = time.time()
        changes = {"started_at": now, "runner": self._runner, "lease_until": now + self._lease_s}
        row = connection.execute(_CLAIM, {"next_job": next_job} | changes).mappings().one_or_none()
        if row is None:
            return None  # another process was faster
        self._turns += 1
        self._served[row["owner"]] = self._turns
        return job_row(row)

    def _next(self, connection: sa.Connection) -> int | None:
        groups = connection.execute(_WAITING).all()
        self.more = sum(count for *_, count in groups) > 1
        top = max((priority for priority, *_ in groups), default=None)
        oldest: dict[str, int] = {owner: number for priority, owner, number, _ in groups if priority == top}
        if len(oldest) <= 1:
            return next(iter(oldest.values()), None)
        running = {row[0]: row[1] for row in connection.execute(_RUNNING)}
        return min((running.get(owner, 0), self._served.get(owner, 0), number) for owner, number in oldest.items())[2]

    @transaction
    def succeed(self, connection: sa.Connection, job_id: str, finding: Finding) -> JobRow | None:
        """Keep a running job's result; the job as it has ended, None when it does not run any more."""
        changes = {
            "grasps": finding.grasps,
            "feasible": finding.feasible,
            "verified": finding.verified,
            "holding_margin": finding.holding_margin,
            "warnings": json.dumps(list(finding.warnings)),
            "finished_at": time.time(),
        }
        which = {"job_id": job_id, "mine": self._runner}
        row = connection.execute(_SUCCEED, which | changes).mappings().one_or_none()
        if row is None:
            return None
        connection.execute(_KEEP, {"job_id": job_id, "document": finding.result})
        return job_row(row)

    @transaction
    def warn(self, connection: sa.Connection, job_id: str, warnings: Sequence[str]) -> None:
        """Add to what went wrong beside the result of a job that has succeeded."""
        known = connection.execute(sa.select(jobs.c.warnings).where(jobs.c.id == job_id)).scalar()
        if known is not None:  # else it was deleted meanwhile
            told = json.dumps([*json.loads(known), *warnings])
            connection.execute(sa.update(jobs).where(jobs.c.id == job_id).values(warnings=told))

    @transaction
    def fail(self, connection: sa.Connection, job_id: str, error: JobError) -> None:
        """End a running job with the reason."""
        _move(connection, self._mine(job_id), "running", _failure(error.code, error.detail))

    @transaction
    def give_back(self, connection: sa.Connection, job_id: str) -> None:
        """Queue a running job again that was stopped for no fault of its own."""
        _move(connection, self._mine(job_id), "running", _QUEUED_AGAIN)

    @transaction
    def count_worker_death(self, connection: sa.Connection, job_id: str) -> bool:
        """Queue a running job again whose worker died, or fail it if that was not the first time.

        Returns:
            Whether it was queued again.
        """
        deaths = jobs.c.worker_deaths + 1
        failed = _failure("worker_died", f"Its worker process died {_MAX_WORKER_DEATHS} times while running it.")
        last = self._mine(job_id) & (deaths >= _MAX_WORKER_DEATHS)
        _move(connection, last, "running", failed | {"worker_deaths": deaths})
        retry = _QUEUED_AGAIN | {"worker_deaths": deaths}
        return _move(connection, self._mine(job_id), "running", retry) is not None

    @transaction
    def extend_leases(self, connection: sa.Connection, job_ids: Sequence[str]) -> None:
        """Say that this process lives and runs these jobs."""
        which = (jobs.c.runner == self._runner) & (jobs.c.state == "running") & jobs.c.id.in_(job_ids)
        connection.execute(sa.update(jobs).where(which).values(lease_until=time.time() + self._lease_s))

    @transaction
    def take_up(self, connection: sa.Connection, *, alone: bool) -> int:
        """Queue what dead processes left running.

        Args:
            connection: The transaction.
            alone: No other process can be alive, so there is no lease to wait for.

        Returns:
            How many were queued again.
        """
        left = jobs.c.state == "running"
        if not alone:
            left &= jobs.c.lease_until < time.time()
        failed = _failure("worker_died", f"The service ended {_MAX_ATTEMPTS} times while running it.")
        connection.execute(sa.update(jobs).where(left, jobs.c.attempts >= _MAX_ATTEMPTS).values(failed))
        return connection.execute(sa.update(jobs).where(left).values(_QUEUED_AGAIN)).rowcount

    def _mine(self, job_id: str) -> sa.ColumnElement[bool]:
        return (jobs.c.id == job_id) & (jobs.c.runner == self._runner)


_QUEUED_AGAIN: dict[str, Any] = {"state": "queued", "runner": None, "lease_until": None}


def _move(connection: sa.Connection, which: sa.ColumnElement[bool], state: str, changes: dict[str, Any]) -> str | None:
    """Change one job that is in ``state``; its id, or None when no such job was in that state."""
    update = sa.update(jobs).where(which, jobs.c.state == state).values(changes).returning(jobs.c.id)
    return connection.execute(update).scalar()


def _failure(code: str, detail: str) -> dict[str, Any]:
    return {
        "state": "failed",
        "error_code": code,
        "error_detail": detail,
        "finished_at": time.time(),
        "lease_until": None,
    }
