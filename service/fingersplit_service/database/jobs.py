"""Jobs as their owners see them: accept, find, list, cancel, delete."""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import sqlalchemy as sa

from fingersplit_client.schemas import JobState
from fingersplit_service.database.rows import LISTED_COLUMNS, JobRow, NewJob, job_row, one_job
from fingersplit_service.database.store import Store, accepting, reading, transaction
from fingersplit_service.database.tables import QUEUED, RUNNING, datasets, jobs, objects, results
from fingersplit_service.database.usage import Limits, count_jobs, refuse_excess

# Statements that every job runs through are built once: building one takes longer than SQLite does to run it.
_COUNT_WAITING = sa.select(sa.func.count()).where(jobs.c.owner == sa.bindparam("of"), QUEUED)
_USE_OBJECTS = (
    sa.update(objects)
    .where(objects.c.owner == sa.bindparam("of"), objects.c.id.in_(sa.bindparam("wanted", expanding=True)))
    .returning(objects.c.id, objects.c.name)
)
_LOCK_OWNER = sa.select(sa.func.pg_advisory_xact_lock(sa.func.hashtextextended(sa.bindparam("of"), 0)))
_AT_ONCE = 500  # ids in one statement
_ADD = sa.insert(jobs).returning(*LISTED_COLUMNS, jobs.c.request, sort_by_parameter_order=True)
_GET = (
    sa.select(*LISTED_COLUMNS, jobs.c.request, results.c.document)
    .outerjoin(results)
    .where(jobs.c.owner == sa.bindparam("of"), jobs.c.id == sa.bindparam("job"))
)

__all__ = ["IdempotencyConflict", "JobFilter", "JobStore", "QueueFull", "UnknownObject"]


class UnknownObject(Exception):  # noqa: N818
    """A job names an object that its owner does not have; ``args`` are its place among the jobs and the id."""


class QueueFull(Exception):  # noqa: N818
    """The owner has too many jobs that wait; ``args`` are how many, and how many may."""


class IdempotencyConflict(Exception):  # noqa: N818
    """The idempotency key belongs to a job that asked for something else; ``args`` is its id."""


@dataclass(frozen=True)
class JobFilter:
    """Which jobs of an owner to list; None means any."""

    states: Sequence[JobState] = ()
    object_id: str | None = None
    hand: str | None = None
    batch_id: str | None = None
    object_name: str | None = None

    def condition(self, owner: str) -> sa.ColumnElement[bool]:
        """As SQL."""
        wanted = {"object_id": self.object_id, "hand": self.hand, "batch_id": self.batch_id}
        conditions = [jobs.c[name] == value for name, value in wanted.items() if value is not None]
        if self.states:
            conditions.append(jobs.c.state.in_(self.states))
        if self.object_name is not None:
            conditions.append(jobs.c.object_name.icontains(self.object_name, autoescape=True))
        return sa.and_(jobs.c.owner == owner, *conditions)


class JobStore(Store):
    """Jobs by owner; nobody finds another's."""

    @accepting
    def add(
        self,
        connection: sa.Connection,
        owner: str,
        new: Sequence[NewJob],
        *,
        longest_queue: int,
        limits: Limits | None = None,
        batch_id: str | None = None,
        idempotency_key: str | None = None,
    ) -> tuple[list[JobRow], bool]:
        """Queue jobs, all or none.

        Args:
            connection: The transaction.
            owner: Whose they are.
            new: The jobs.
            longest_queue: How many jobs of the owner may wait.
            limits: What else the owner may.
            batch_id: The batch they came in.
            idempotency_key: With it, a second call returns the first one's jobs.

        Returns:
            The jobs, and whether they are new.

        Raises:
            UnknownObject: An object is not the owner's.
            QueueFull: Too many jobs of the owner wait.
            LimitReached: The owner has used what it may.
            IdempotencyConflict: The key was used for something else.
        """
        if connection.dialect.name == "postgresql":  # of one owner one after the other: keys and limits are exact
            connection.execute(_LOCK_OWNER, {"of": owner})
        if idempotency_key is not None:
            known = one_job(connection, (jobs.c.owner == owner) & (jobs.c.idempotency_key == idempotency_key))
            if known is not None:
                if _request_hash(connection, known.id) != new[0].request_hash:
                    raise IdempotencyConflict(known.id)
                return [known] if known.batch_id is None else _jobs_of_batch(connection, known.batch_id), False
        waiting = connection.execute(_COUNT_WAITING, {"of": owner}).scalar_one()
        if waiting + len(new) > longest_queue:
            raise QueueFull(waiting, longest_queue)
        if limits is not None:
            refuse_excess(connection, owner, limits, len(new))
            count_jobs(connection, owner, len(new))
        now = time.time()
        names = _object_names(connection, owner, new, now)
        shared = {
            "owner": owner,
            "batch_id": batch_id,
            "idempotency_key": None,
            "state": "queued",
            "attempts": 0,
            "worker_deaths": 0,
            "warnings": "[]",
            "created_at": now,
        }
        rows = [shared | asdict(job) | {"object_name": names[job.object_id]} for job in new]
        rows[0]["idempotency_key"] = idempotency_key
        return [job_row(row) for row in connection.execute(_ADD, rows).mappings()], True

    @reading
    def get(self, connection: sa.Connection, owner: str, job_id: str) -> tuple[JobRow, str | None] | None:
        """A job and its result document, JSON; None when the owner has no such job."""
        row = connection.execute(_GET, {"of": owner, "job": job_id}).mappings().one_or_none()
        if row is None:
            return None
        columns = dict(row)
        result: str | None = columns.pop("document")
        return job_row(columns), result

    @reading
    def page(
        self, connection: sa.Connection, owner: str, which: JobFilter, before: int | None, limit: int
    ) -> list[JobRow]:
        """Jobs of an owner, newest first, older than the place ``before``, without their requests."""
        query = sa.select(*LISTED_COLUMNS).where(which.condition(owner))
        if before is not None:
            query = query.where(jobs.c.number < before)
        rows = connection.execute(query.order_by(jobs.c.number.desc()).limit(limit)).mappings()
        return [job_row(row) for row in rows]

    @accepting
    def cancel(self, connection: sa.Connection, owner: str, job_id: str) -> JobRow | None:
        """End a job that has not ended; None when the owner has no such job."""
        update = (
            sa.update(jobs)
            .where(_is(owner, job_id), jobs.c.state.in_(("queued", "running")))
            .values(state="cancelled", finished_at=time.time())
        )
        connection.execute(update)
        return one_job(connection, _is(owner, job_id))

    @accepting
    def cancel_batch(self, connection: sa.Connection, owner: str, batch_id: str) -> list[str]:
        """End all jobs of a batch that have not ended; the ids of those."""
        update = (
            sa.update(jobs)
            .where(jobs.c.owner == owner, jobs.c.batch_id == batch_id, jobs.c.state.in_(("queued", "running")))
            .values(state="cancelled", finished_at=time.time())
            .returning(jobs.c.id)
        )
        return list(connection.execute(update).scalars())

    @accepting
    def delete(self, connection: sa.Connection, owner: str, job_id: str) -> bool:
        """Delete a job in whatever state, with its result; False when the owner has no such job."""
        return connection.execute(sa.delete(jobs).where(_is(owner, job_id))).rowcount == 1

    @reading
    def batch(self, connection: sa.Connection, owner: str, batch_id: str) -> list[tuple[str, JobState]]:
        """Ids and states of a batch's jobs in their order; empty when the owner has no such batch."""
        # By the batch alone: with the owner in the condition PostgreSQL may read all jobs of the owner instead.
        query = sa.select(jobs.c.owner, jobs.c.id, jobs.c.state).where(jobs.c.batch_id == batch_id)
        rows = connection.execute(query.order_by(jobs.c.number))
        return [(job_id, state) for whose, job_id, state in rows if whose == owner]

    @reading
    def batches(
        self, connection: sa.Connection, owner: str, before: int | None, limit: int
    ) -> list[tuple[int, str, dict[JobState, int]]]:
        """Batches, newest first, older than the place ``before``: place of the first job, id, counts by state."""
        filled = sa.select(datasets.c.id).where(datasets.c.owner == owner)
        of_owner = sa.and_(jobs.c.owner == owner, jobs.c.batch_id.is_not(None), jobs.c.batch_id.not_in(filled))
        first = sa.func.min(jobs.c.number)
        query = sa.select(jobs.c.batch_id, first).where(of_owner).group_by(jobs.c.batch_id)
        if before is not None:
            query = query.having(first < before)
        places = {row[0]: row[1] for row in connection.execute(query.order_by(first.desc()).limit(limit))}
        counted = sa.select(jobs.c.batch_id, jobs.c.state, sa.func.count()).where(jobs.c.owner == owner)
        counts: dict[str, dict[JobState, int]] = {batch_id: {} for batch_id in places}
        grouped = counted.where(jobs.c.batch_id.in_(list(places))).group_by(jobs.c.batch_id, jobs.c.state)
        for batch_id, state, count in connection.execute(grouped):
            counts[batch_id][state] = count
        return [(place, batch_id, counts[batch_id]) for batch_id, place in places.items()]

    @reading
    def states(self, connection: sa.Connection, job_ids: Sequence[str]) -> list[JobRow]:
        """Where jobs of any owner stand, without their requests."""
        found = list[JobRow]()
        for start in range(0, len(job_ids), _AT_ONCE):
            query = sa.select(*LISTED_COLUMNS).where(jobs.c.id.in_(job_ids[start : start + _AT_ONCE]))
            found += [job_row(row) for row in connection.execute(query).mappings()]
        return found

    @reading
    def check(self, connection: sa.Connection) -> None:
        """Read something, to see that the database answers."""
        connection.execute(sa.select(jobs.c.number).limit(1))

    @reading
    def counts(self, connection: sa.Connection) -> dict[str, int]:
        """How many jobs of all owners are queued and running."""
        return {
            state: connection.execute(sa.select(sa.func.count()).where(which)).scalar_one()
            for state, which in (("queued", QUEUED), ("running", RUNNING))
        }

    @reading
    def without_rows(self, connection: sa.Connection, job_ids: Sequence[str]) -> list[str]:
        """Those of some ids that are no job's."""
        known = set[str]()
        for start in range(0, len(job_ids), _AT_ONCE):
            some = job_ids[start : start + _AT_ONCE]
            known |= set(connection.execute(sa.select(jobs.c.id).where(jobs.c.id.in_(some))).scalars())
        return [job_id for job_id in job_ids if job_id not in known]

    @transaction
    def delete_ended_before(self, connection: sa.Connection, moment: float, limit: int) -> list[str]:
        """Delete jobs that ended before ``moment``; their ids."""
        query = sa.select(jobs.c.id).where(jobs.c.finished_at < moment).limit(limit)
        old = list(connection.execute(query).scalars())
        connection.execute(sa.delete(jobs).where(jobs.c.id.in_(old)))
        return old


def _object_names(connection: sa.Connection, owner: str, new: Sequence[NewJob], now: float) -> dict[str, str]:
    """Names of the jobs' objects, which are marked as used."""
    wanted = list({job.object_id for job in new})
    rows = connection.execute(_USE_OBJECTS, {"of": owner, "wanted": wanted, "used_at": now})
    names = {row[0]: row[1] for row in rows}
    for place, job in enumerate(new):
        if job.object_id not in names:
            raise UnknownObject(place, job.object_id)
    return names


def _jobs_of_batch(connection: sa.Connection, batch_id: str) -> list[JobRow]:
    query = sa.select(*LISTED_COLUMNS).where(jobs.c.batch_id == batch_id).order_by(jobs.c.number)
    return [job_row(row) for row in connection.execute(query).mappings()]


def _request_hash(connection: sa.Connection, job_id: str) -> str | None:
    return connection.execute(sa.select(jobs.c.request_hash).where(jobs.c.id == job_id)).scalar()


def _is(owner: str, job_id: str) -> sa.ColumnElement[bool]:
    return (jobs.c.owner == owner) & (jobs.c.id == job_id)
