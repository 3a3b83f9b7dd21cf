"""Runs whose first grasp is to be verified behind the answer: who is next, and what came of it.

``jobs.verification`` says where that stands: ``pending``, ``done`` or ``failed``, nothing where it is not wanted.
"""

import sqlalchemy as sa

from fingersplit_service.database.connection import Database, Store, transaction
from fingersplit_service.database.rows import LISTED_COLUMNS, JobRow, job_row
from fingersplit_service.database.tables import jobs, results

__all__ = ["FollowUpStore"]

_MAX_ATTEMPTS = 5  # one that kills its worker or the service each time is given up
_WAITING = (
    sa.select(jobs.c.owner, sa.func.min(jobs.c.number)).where(jobs.c.verification == "pending").group_by(jobs.c.owner)
)


class FollowUpStore(Store):
    """Follow-ups as their runner sees them.

    Args:
        database: Where the jobs are.
    """

    def __init__(self, database: Database) -> None:
        super().__init__(database)
        self._served: dict[str, int] = {}
        self._claimed: set[str] = set()  # ids: SQLite gives the number of a deleted job to another
        self._claims = 0

    @transaction
    def claim(self, connection: sa.Connection) -> tuple[JobRow, str] | None:
        """The next job to follow up with its result document, counting the attempt before it begins.

        The owner that was served least recently comes first, of its jobs the oldest. What is claimed stays pending in
        the table until it is finished, so the next process finds it when this one dies.
        """
        spent = (jobs.c.verification == "pending") & (jobs.c.verification_attempts >= _MAX_ATTEMPTS)
        connection.execute(sa.update(jobs).where(spent, jobs.c.id.not_in(self._claimed)).values(verification="failed"))
        waiting = _WAITING.where(jobs.c.id.not_in(self._claimed))
        groups = [(self._served.get(owner, 0), number, owner) for owner, number in connection.execute(waiting)]
        if not groups:
            return None
        _, number, owner = min(groups)
        which = jobs.c.number == number
        count = {"verification_attempts": jobs.c.verification_attempts + 1}
        connection.execute(sa.update(jobs).where(which).values(count))
        query = sa.select(*LISTED_COLUMNS, jobs.c.request, results.c.document).join(results).where(which)
        row = dict(connection.execute(query).mappings().one())
        document: str = row.pop("document")
        self._claims += 1
        self._served[owner] = self._claims
        job = job_row(row)
        self._claimed.add(job.id)
        return job, document

    @transaction
    def finish(self, connection: sa.Connection, job: JobRow, document: str, verified: int) -> JobRow | None:
        """Keep a result with its verification; the job as it is now, None when it was deleted meanwhile."""
        which = (jobs.c.id == job.id) & (jobs.c.verification == "pending")
        update = sa.update(jobs).where(which).values(verification="done", verified=verified)
        row = connection.execute(update.returning(*LISTED_COLUMNS, jobs.c.request)).mappings().one_or_none()
        if row is None:
            return None
        connection.execute(sa.update(results).where(results.c.job_id == job.id).values(document=document))
        return job_row(row)

    @transaction
    def fail(self, connection: sa.Connection, job: JobRow) -> JobRow | None:
        """Give a follow-up up; the job as it is now, None when it was deleted meanwhile."""
        which = (jobs.c.id == job.id) & (jobs.c.verification == "pending")
        update = sa.update(jobs).where(which).values(verification="failed")
        row = connection.execute(update.returning(*LISTED_COLUMNS, jobs.c.request)).mappings().one_or_none()
        return None if row is None else job_row(row)

    def release(self, job: JobRow) -> None:
        """Let a claimed follow-up be claimed again."""
        self._claimed.discard(job.id)
