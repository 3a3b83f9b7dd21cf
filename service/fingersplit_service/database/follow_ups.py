"""Runs whose first grasp is to be verified behind the answer: who is next, and what came of it.

``jobs.verification`` says where that stands: ``pending``, ``done`` or ``failed``, nothing where it is not wanted. While
``jobs.verifier`` names somebody, it is being done; the number of the attempt is the token to write what came of it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import sqlalchemy as sa

from fingersplit_service.database.connection import Database
from fingersplit_service.database.rows import LISTED_COLUMNS, JobRow, job_row
from fingersplit_service.database.store import Store, transaction
from fingersplit_service.database.tables import jobs, results

__all__ = ["FollowUp", "FollowUpStore"]

_MAX_ATTEMPTS = 5  # one that kills its worker or the service each time is given up
_ONLY_ONE = "service"  # who verifies where there is one machine
_FREE = (jobs.c.verification == "pending") & jobs.c.verifier.is_(None)
_WAITING = sa.select(jobs.c.owner, sa.func.min(jobs.c.number)).where(_FREE).group_by(jobs.c.owner)
_SPENT = _FREE & (jobs.c.verification_attempts >= _MAX_ATTEMPTS)


@dataclass(frozen=True)
class FollowUp:
    """A job whose first grasp is to be verified.

    Attributes:
        job: The job.
        result: Its result document, JSON.
        attempt: Which attempt this is.
        verifier: Who makes it.
    """

    job: JobRow
    result: str
    attempt: int
    verifier: str


class FollowUpStore(Store):
    """Follow-ups as their runner sees them.

    Args:
        database: Where the jobs are.
        verifier: Says who this is, where several machines do it.
    """

    def __init__(self, database: Database, verifier: Callable[[], str] = lambda: _ONLY_ONE) -> None:
        super().__init__(database)
        self._verifier = verifier
        self._served: dict[str, int] = {}
        self._claims = 0

    @transaction
    def begin(self, connection: sa.Connection) -> None:
        """Take over what an earlier process of this machine left."""
        left = jobs.c.verifier == self._verifier()
        connection.execute(sa.update(jobs).where(jobs.c.verification == "pending", left).values(verifier=None))

    @transaction
    def claim(self, connection: sa.Connection) -> FollowUp | None:
        """The next job to follow up, counting the attempt before it begins.

        The owner that was served least recently comes first, of its jobs the oldest. What is claimed stays pending in
        the table until it is finished, so it is found when this process dies.
        """
        connection.execute(sa.update(jobs).where(_SPENT).values(verification="failed"))
        waiting = connection.execute(_WAITING).all()
        groups = [(self._served.get(owner, 0), number, owner) for owner, number in waiting]
        for _, number, owner in sorted(groups):
            which, verifier = jobs.c.number == number, self._verifier()
            values = {"verification_attempts": jobs.c.verification_attempts + 1, "verifier": verifier}
            update = sa.update(jobs).where(which, _FREE).values(values).returning(jobs.c.verification_attempts)
            attempt = connection.execute(update).scalar()
            if attempt is None:  # another machine was first
                continue
            query = sa.select(*LISTED_COLUMNS, jobs.c.request, results.c.document).join(results).where(which)
            row = dict(connection.execute(query).mappings().one())
            document: str = row.pop("document")
            self._claims += 1
            self._served[owner] = self._claims
            return FollowUp(job_row(row), document, attempt, verifier)
        return None

    @transaction
    def finish(self, connection: sa.Connection, done: FollowUp, document: str, verified: int) -> JobRow | None:
        """Keep a result with its verification; the job as it is now, None when it is not this attempt's any more."""
        values = {"verification": "done", "verified": verified, "result_bytes": len(document)}
        row = self._end(connection, done, values)
        if row is not None:
            connection.execute(sa.update(results).where(results.c.job_id == row.id).values(document=document))
        return row

    @transaction
    def fail(self, connection: sa.Connection, done: FollowUp) -> JobRow | None:
        """Give a follow-up up; the job as it is now, None when it is not this attempt's any more."""
        return self._end(connection, done, {"verification": "failed"})

    @transaction
    def release(self, connection: sa.Connection, done: FollowUp) -> None:
        """Let a claimed follow-up be claimed again."""
        connection.execute(sa.update(jobs).where(_attempt(done)).values(verifier=None))

    @staticmethod
    def _end(connection: sa.Connection, done: FollowUp, values: dict[str, object]) -> JobRow | None:
        update = sa.update(jobs).where(_attempt(done)).values(values | {"verifier": None})
        row = connection.execute(update.returning(*LISTED_COLUMNS, jobs.c.request)).mappings().one_or_none()
        return None if row is None else job_row(row)


def _attempt(done: FollowUp) -> sa.ColumnElement[bool]:
    """The job while its first grasp is verified by this attempt."""
    return (
        (jobs.c.id == done.job.id)
        & (jobs.c.verification == "pending")
        & (jobs.c.verification_attempts == done.attempt)
        & (jobs.c.verifier == done.verifier)
    )
