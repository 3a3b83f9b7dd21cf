"""The queue of several machines in PostgreSQL: claims that do not wait for each other, and jobs of silent machines.

The token of whoever runs a job is the number of the attempt together with the agent. Everything that one agent can do
to another's job goes through `rescue`.
"""

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

import sqlalchemy as sa

from fingersplit_service.database.connection import Database
from fingersplit_service.database.queue import QUEUED_AGAIN, JobQueue, failure
from fingersplit_service.database.rows import LISTED_COLUMNS, JobRow, job_row
from fingersplit_service.database.store import transaction
from fingersplit_service.database.tables import RUNNING, agents, jobs

__all__ = ["Beat", "ClusterQueue", "Requeued"]

_MAX_ABANDONED = 5  # a job under which machines fall silent is not run for ever
_HEAD_EVERY = 16  # claims, of which one takes the oldest job whether its object is warm or not
_WINDOW = 200  # jobs of an owner among which one with a warm object may be taken before older ones
_CANDIDATES = 32  # jobs that are tried: others may be claiming some of them at this moment
_RESCUE_LOCK = 0x66696E69  # of PostgreSQL, held by the one agent that rescues
_RESCUE_WAITS = "1s"  # for rows that a machine holds which was stopped within a transaction; then it is tried again
_UNKNOWN_FOR = 3.0  # how long a job may be this agent's in the table before the agent knows of it [s]
_NOW = sa.cast(sa.func.extract("epoch", sa.func.clock_timestamp()), sa.Float(53))

_TOLD = sa.values(sa.column("job", sa.String), sa.column("stage", sa.String), sa.column("share", sa.Float(53)))

# The owners with waiting jobs, by jumps through the index instead of reading over the whole queue.
_OWNERS = sa.text(
    """
    WITH RECURSIVE waiting(owner) AS (
        -- In the order of their index, which no other one gives.
        (SELECT owner FROM jobs WHERE state = 'queued' ORDER BY owner, priority, number LIMIT 1)
        UNION ALL
        SELECT (SELECT jobs.owner FROM jobs WHERE state = 'queued' AND jobs.owner > waiting.owner
                ORDER BY jobs.owner, jobs.priority, jobs.number LIMIT 1)
        FROM waiting WHERE waiting.owner IS NOT NULL
    )
    SELECT owner,
           -- What the database's machine forgets of a claim when it loses power is noticed by the agent's next beat.
           set_config('synchronous_commit', 'off', true),
           -- A plan that was made for any owner and few rows may later read every job that an owner ever had.
           set_config('plan_cache_mode', 'force_custom_plan', true)
    FROM waiting WHERE owner IS NOT NULL
    """
)
_FAIREST_FIRST = sa.text(
    """
    SELECT owner FROM unnest(CAST(:owners AS text[])) AS waiting(owner)
    ORDER BY (SELECT count(*) FROM jobs WHERE jobs.state = 'running' AND jobs.owner = waiting.owner),
             (SELECT max(started_at) FROM jobs WHERE jobs.owner = waiting.owner) NULLS FIRST, owner
    """
)
_ONE_OR_TWO = "SELECT 1 FROM jobs WHERE state = 'queued' ORDER BY owner, priority, number LIMIT 2"
_COLUMNS = ", ".join(f"jobs.{column.name}" for column in (*LISTED_COLUMNS, jobs.c.request))


def _claim_statement(candidates: str) -> sa.TextClause:
    """Take the first of some jobs that nobody else is taking; as text, since every job passes it."""
    return sa.text(
        f"""
        UPDATE jobs SET state = 'running', attempts = attempts + 1, started_at = :now, runner = :agent,
                        stage = NULL, progress = NULL
        WHERE state = 'queued' AND number = (
            SELECT number FROM jobs WHERE state = 'queued' AND number = ANY(ARRAY({candidates}))
            ORDER BY number LIMIT 1 FOR UPDATE SKIP LOCKED)
        RETURNING {_COLUMNS}, (SELECT count(*) FROM ({_ONE_OR_TWO}) AS those) AS were_queued
        """
    )


def _first(columns: str, limit: str) -> str:
    """The oldest jobs of an owner's highest priority, from the index alone."""
    return f"""
        SELECT {columns} FROM jobs WHERE state = 'queued' AND owner = :owner
        AND priority = (SELECT max(priority) FROM jobs WHERE state = 'queued' AND owner = :owner)
        ORDER BY number LIMIT {limit}
    """


_CLAIM_FIRST = _claim_statement(_first("number", f"{_CANDIDATES}"))
_CLAIM_NEAR = _claim_statement(
    f"""
    SELECT number FROM ({_first("number, object_id", ":window")}) AS first
    WHERE object_id = ANY(:warm) LIMIT {_CANDIDATES}
    """
)


@dataclass(frozen=True)
class Beat:
    """What an agent learns when it gives a sign of life.

    Attributes:
        known: Whether it still counts as alive; if not, others have taken its jobs.
        lost: Ids of jobs that it runs and that are not its own any more: cancelled, deleted or taken over.
        alive: Ids of all agents in an order that they agree on; the first does what is done once for all.
    """

    known: bool
    lost: Collection[str] = ()
    alive: Sequence[str] = ()


@dataclass(frozen=True)
class Requeued:
    """Jobs of machines that fell silent: those that wait again, and those that were given up."""

    queued: Collection[str] = ()
    failed: Collection[str] = ()


class ClusterQueue(JobQueue):
    """The queue as one of several agents sees it.

    Args:
        database: Where the jobs are.
        name: Machine and process, for people.
        workers: How many jobs this agent runs at once.

    Attributes:
        agent: Id of this agent; a new one after others have given it up.
    """

    def __init__(self, database: Database, name: str, workers: int) -> None:
        super().__init__(database)
        self.agent = uuid4().hex
        self._name, self._workers = name, workers

    async def begin(self) -> None:
        """Register as an agent."""
        await self.register()

    @transaction
    def register(self, connection: sa.Connection) -> None:
        """Become an agent, under a new id."""
        self.agent = uuid4().hex
        row = {"id": self.agent, "name": self._name, "workers": self._workers, "started_at": time.time()}
        connection.execute(sa.insert(agents).values(row | {"beat_at": _NOW}))

    @transaction
    def leave(self, connection: sa.Connection) -> None:
        """Stop being an agent; whatever it still runs is taken over at once."""
        connection.execute(sa.delete(agents).where(agents.c.id == self.agent))

    @transaction
    def claim(self, connection: sa.Connection, warm: Collection[str] = ()) -> JobRow | None:
        """Take a job for a worker, counting the attempt before it begins.

        The owner is chosen first: the one with the fewest running jobs, of these the one that was served least
        recently. Of that owner's jobs of the highest priority one goes first whose object is warm here, but for every
        sixteenth claim, then the oldest.

        Args:
            connection: The transaction.
            warm: Ids of objects that free workers of this agent hold ready.
        """
        self._claims += 1
        prefer = warm if self._claims % _HEAD_EVERY else ()
        owners: Sequence[str] = connection.execute(_OWNERS).scalars().all()
        if len(owners) > 1:
            owners = connection.execute(_FAIREST_FIRST, {"owners": list(owners)}).scalars().all()
        for owner in owners:
            row = self._claim_of(connection, owner, prefer)
            if row is not None:
                values = dict(row)
                self.more = values.pop("were_queued") > 1  # the one that was taken is among them
                return job_row(values)
        self.more = False
        return None

    def _claim_of(self, connection: sa.Connection, owner: str, warm: Collection[str]) -> Mapping[Any, Any] | None:
        given = {"owner": owner, "agent": self.agent, "now": time.time(), "warm": list(warm), "window": _WINDOW}
        for statement in (_CLAIM_NEAR, _CLAIM_FIRST) if warm else (_CLAIM_FIRST,):
            row = connection.execute(statement, given).mappings().one_or_none()
            if row is not None:
                return row
        return None

    @transaction
    def beat(self, connection: sa.Connection, running: Mapping[str, tuple[int, str | None, float | None]]) -> Beat:
        """Give a sign of life, and compare what runs here with the table.

        A job that is this agent's in the table and does not run here, since the answer to its claim was lost, waits
        again.

        Args:
            connection: The transaction.
            running: By job: the attempt, what it does and how much is done.
        """
        sign = sa.update(agents).where(agents.c.id == self.agent).values(beat_at=_NOW).returning(agents.c.id)
        if connection.execute(sign).scalar() is None:
            return Beat(known=False)
        mine = RUNNING & (jobs.c.runner == self.agent)
        rows = connection.execute(sa.select(jobs.c.id, jobs.c.attempts, jobs.c.started_at).where(mine)).all()
        table = {row[0]: (row[1], row[2]) for row in rows}
        before = time.time() - _UNKNOWN_FOR
        unknown = [one for one, (_, began) in table.items() if one not in running and began < before]
        if unknown:
            values = QUEUED_AGAIN | {"runner": None}
            connection.execute(sa.update(jobs).where(mine, jobs.c.id.in_(unknown)).values(values))
        told = [
            (one, stage, share)
            for one, (attempt, stage, share) in running.items()
            if share is not None and table.get(one, (0, 0.0))[0] == attempt
        ]
        if told:
            # In one statement: between those of a pipeline no time-out ends the session of a process that stands still.
            rows_told = _TOLD.data(told).alias("told")
            values = {"stage": rows_told.c.stage, "progress": rows_told.c.share}
            connection.execute(sa.update(jobs).where(mine, jobs.c.id == rows_told.c.job).values(values))
        lost = [one for one, (attempt, *_) in running.items() if table.get(one, (0, 0.0))[0] != attempt]
        alive = connection.execute(sa.select(agents.c.id).order_by(agents.c.id)).scalars().all()
        return Beat(known=True, lost=lost, alive=alive)

    @transaction
    def rescue(self, connection: sa.Connection, silence_s: float) -> Requeued:
        """Take the jobs of agents that gave no sign of life for ``silence_s`` seconds; one agent does it at a time."""
        # The lock is one of the transaction: poolers keep it, too.
        lock = sa.select(
            sa.func.pg_try_advisory_xact_lock(_RESCUE_LOCK), sa.func.set_config("lock_timeout", _RESCUE_WAITS, True)
        )
        if not connection.execute(lock).scalar():
            return Requeued()
        silent = sa.delete(agents).where(agents.c.beat_at < _NOW - silence_s, agents.c.id != self.agent)
        connection.execute(silent)
        alive = sa.select(agents.c.id)
        left = RUNNING & (jobs.c.runner.is_(None) | jobs.c.runner.not_in(alive))
        detail = f"The machine that ran it fell silent {_MAX_ABANDONED} times."
        again = {"abandoned": jobs.c.abandoned + 1, "runner": None}
        last = left & (jobs.c.abandoned >= _MAX_ABANDONED - 1)
        failed = sa.update(jobs).where(last).values(failure("worker_died", detail) | again).returning(jobs.c.id)
        queued = sa.update(jobs).where(left).values(QUEUED_AGAIN | again).returning(jobs.c.id)
        given_up = list(connection.execute(failed).scalars())
        rescued = list(connection.execute(queued).scalars())
        unverified = jobs.c.verifier.is_not(None) & jobs.c.verifier.not_in(alive)
        connection.execute(sa.update(jobs).where(jobs.c.verification == "pending", unverified).values(verifier=None))
        return Requeued(rescued, given_up)

    def _fence(self) -> sa.ColumnElement[bool]:
        return super()._fence() & (jobs.c.runner == sa.bindparam("agent"))

    def _token(self, job: JobRow) -> dict[str, Any]:
        return super()._token(job) | {"agent": job.runner}
