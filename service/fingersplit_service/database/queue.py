"""The queue inside the job table: who is next, and what became of it.

Each change of a job's state is one ``UPDATE ... WHERE state = 'running' AND attempts = ...``: the number of the attempt
is the token of whoever runs it, so a worker that was given up cannot write a result any more.
"""

import json
import time
from collections.abc import Collection
from typing import Any, Literal

import sqlalchemy as sa

from fingersplit_client.schemas import JobError
from fingersplit_service.database.connection import Database
from fingersplit_service.database.result_row import JobResultRow
from fingersplit_service.database.rows import LISTED_COLUMNS, JobRow, job_row
from fingersplit_service.database.store import Store, statement, transaction
from fingersplit_service.database.tables import QUEUED, RUNNING, jobs, results

__all__ = ["QUEUED_AGAIN", "JobQueue", "failure"]

_MAX_WORKER_DEATHS = 2
_MAX_ATTEMPTS = 10  # a job under which the whole service dies each time is not run for ever

# Statements that every job runs through are built once: building one takes longer than SQLite does to run it.
_WAITING = (
    sa.select(jobs.c.owner, jobs.c.priority, sa.func.min(jobs.c.number), sa.func.count())
    .where(QUEUED)
    .group_by(jobs.c.owner, jobs.c.priority)
)
_RUNNING = sa.select(jobs.c.owner, sa.func.count()).where(RUNNING).group_by(jobs.c.owner)
_CLAIM = (
    sa.update(jobs)
    .where(jobs.c.number == sa.bindparam("next_job"), QUEUED)
    .values(state="running", attempts=jobs.c.attempts + 1)  # and what else is given
    .returning(*LISTED_COLUMNS, jobs.c.request)
)
_THIS_ATTEMPT = (jobs.c.id == sa.bindparam("job_id")) & (jobs.c.attempts == sa.bindparam("attempt")) & RUNNING
_CHANGES = (
    *("grasps", "feasible", "verified", "holding_margin", "warnings"),
    *("verification", "result_bytes", "finished_at"),
)
_KEEP = sa.insert(results)
QUEUED_AGAIN: dict[str, Any] = {"state": "queued"}
"""What a job that waits again has in its row."""


class JobQueue(Store):
    """Jobs as the dispatcher sees them.

    Args:
        database: Where they are.

    Attributes:
        more: Whether jobs were left in the queue when one was claimed last.
    """

    def __init__(self, database: Database) -> None:
        super().__init__(database)
        self.more = False
        self._served: dict[str, int] = {}
        self._claims = 0
        changes = {name: sa.bindparam(f"new_{name}", type_=jobs.c[name].type) for name in _CHANGES}
        succeed = sa.update(jobs).where(self._fence()).values(state="succeeded", **changes)
        ended = succeed.returning(*LISTED_COLUMNS, jobs.c.request)
        self._succeed: sa.Executable = _with_document(ended) if database.is_postgresql else ended
        self._keeps_document = not database.is_postgresql

    async def begin(self) -> None:
        """Take over what a process that ended left running; call it before anything is claimed."""
        await self.requeue_orphans()

    @transaction
    def claim(self, connection: sa.Connection, warm: Collection[str] = ()) -> JobRow | None:  # noqa: ARG002
        """Take a job for a worker, counting the attempt before it begins.

        The owner is chosen first: the one with the fewest running jobs, of these the one that was served least
        recently. Of that owner's jobs the highest priority goes first, within it the oldest. On one machine ``warm``
        does not count: whichever worker holds the object of a job takes it.
        """
        next_job = self._next(connection)
        if next_job is None:
            return None
        row = connection.execute(_CLAIM, {"next_job": next_job, "started_at": time.time()}).mappings().one_or_none()
        if row is None:
            return None
        self._claims += 1
        self._served[row["owner"]] = self._claims
        return job_row(row)

    def _next(self, connection: sa.Connection) -> int | None:
        groups = connection.execute(_WAITING).all()
        self.more = sum(count for *_, count in groups) > 1
        best: dict[str, tuple[int, int]] = {}  # by owner: negative priority, number
        for owner, priority, number, _ in groups:
            best[owner] = min(best.get(owner, (-priority, number)), (-priority, number))
        if len(best) <= 1:
            return next((number for _, number in best.values()), None)
        running = {row[0]: row[1] for row in connection.execute(_RUNNING)}
        owner = min(best, key=lambda one: (running.get(one, 0), self._served.get(one, 0), best[one][1]))
        return best[owner][1]

    @statement
    def succeed(
        self, connection: sa.Connection, job: JobRow, result: JobResultRow, *, verify: bool = False
    ) -> JobRow | None:
        """Keep a running job's result; the job as it has ended, None when it is not running this attempt any more.

        With ``verify`` its first grasp is to be verified behind the answer, which is noted in the same transaction.
        """
        changes = {
            "grasps": result.grasps,
            "feasible": result.feasible,
            "verified": result.verified,
            "holding_margin": result.holding_margin,
            "warnings": json.dumps(result.warnings),
            "verification": "pending" if verify else None,
            "result_bytes": len(result.result),
            "finished_at": time.time(),
        }
        given = {f"new_{name}": value for name, value in changes.items()} | {"document": result.result}
        row = connection.execute(self._succeed, self._token(job) | given).mappings().one_or_none()
        if row is None:
            return None
        if self._keeps_document:
            connection.execute(_KEEP, {"job_id": job.id, "document": result.result})
        return job_row(row)

    @transaction
    def fail(self, connection: sa.Connection, job: JobRow, error: JobError) -> bool:
        """End a running job with the reason; whether it was still running this attempt."""
        return self._move(connection, job, failure(error.code, error.detail))

    @transaction
    def requeue(self, connection: sa.Connection, job: JobRow) -> bool:
        """Queue a running job again that was stopped for no fault of its own; whether it was still running."""
        return self._move(connection, job, QUEUED_AGAIN)

    @transaction
    def count_worker_death(self, connection: sa.Connection, job: JobRow) -> Literal["queued", "failed"] | None:
        """Queue a running job again whose worker died, or fail it if that was not the first time.

        Returns:
            The state that it has now; None when it was not running this attempt any more.
        """
        deaths = jobs.c.worker_deaths + 1
        failed = failure("worker_died", f"Its worker process died {_MAX_WORKER_DEATHS} times while running it.")
        if self._move(connection, job, failed | {"worker_deaths": deaths}, deaths >= _MAX_WORKER_DEATHS):
            return "failed"
        queued = self._move(connection, job, QUEUED_AGAIN | {"worker_deaths": deaths})
        return "queued" if queued else None

    @transaction
    def requeue_orphans(self, connection: sa.Connection) -> int:
        """Queue what a process that ended left running; call it before anything is claimed.

        Returns:
            How many were queued again.
        """
        left = RUNNING
        failed = failure("worker_died", f"The service ended {_MAX_ATTEMPTS} times while running it.")
        connection.execute(sa.update(jobs).where(left, jobs.c.attempts >= _MAX_ATTEMPTS).values(failed))
        return connection.execute(sa.update(jobs).where(left).values(QUEUED_AGAIN)).rowcount

    def _fence(self) -> sa.ColumnElement[bool]:
        """That a job still runs an attempt, whose `_token` is given when the statement is run."""
        return _THIS_ATTEMPT

    def _token(self, job: JobRow) -> dict[str, Any]:
        return {"job_id": job.id, "attempt": job.attempts}

    def _move(
        self,
        connection: sa.Connection,
        job: JobRow,
        changes: dict[str, Any],
        when: Any = None,
    ) -> bool:
        """Change a job while it runs this attempt; whether it did."""
        which = self._fence() if when is None else self._fence() & when
        return connection.execute(sa.update(jobs).where(which).values(changes), self._token(job)).rowcount == 1


def _with_document(ended: Any) -> sa.Select[Any]:
    """An update that returns a job as one statement that keeps its result, too; SQLite has no such statements."""
    job = ended.cte("job")
    kept = sa.insert(results).from_select(
        ["job_id", "document"], sa.select(job.c.id, sa.bindparam("document", type_=results.c.document.type))
    )
    return sa.select(job).add_cte(kept.cte("kept"))


def failure(code: str, detail: str) -> dict[str, Any]:
    """What a job that failed has in its row."""
    return {"state": "failed", "error_code": code, "error_detail": detail, "finished_at": time.time()}
