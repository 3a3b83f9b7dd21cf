"""What each owner uses, and how much each may: jobs a minute, jobs that wait, bytes kept, CPU time a day."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from fingersplit_service.database.store import Store, reading, transaction
from fingersplit_service.database.tables import QUEUED, hands, jobs, objects, usage
from fingersplit_service.settings import ServiceSettings

__all__ = ["LimitReached", "Limits", "UsageStore", "Used", "count_jobs", "refuse_excess"]

_MINUTE, _DAY = 60, 86_400
# Built once, as every job that is accepted runs through one of them.
_ADD = {
    dialect.dialect.name: (insert := dialect.insert(usage)).on_conflict_do_update(
        index_elements=["owner", "kind", "start"], set_={"amount": usage.c.amount + insert.excluded.amount}
    )
    for dialect in (sqlite, postgresql)
}
_KEPT = 30 * _DAY  # how long what was used stands in the table [s]


class LimitReached(Exception):  # noqa: N818
    """An owner has used what it may.

    Args:
        detail: What, how much, and until when.
        limit: How much it may.
        until: When there is more [s since 1970]; None where something has to be deleted first.
    """

    def __init__(self, detail: str, limit: float, until: float | None) -> None:
        super().__init__(detail)
        self.limit, self.until = limit, until


@dataclass(frozen=True)
class Limits:
    """What an owner may use; None means any amount.

    Attributes:
        jobs_per_minute: Jobs accepted in a minute of the clock.
        stored_bytes: Objects, uploaded hands and results together [bytes].
        cpu_s_per_day: CPU time of workers in a day, UTC [s].
    """

    jobs_per_minute: int | None = None
    stored_bytes: int | None = None
    cpu_s_per_day: float | None = None

    @classmethod
    def of(cls, settings: ServiceSettings) -> "Limits":
        """The limits of every owner."""
        return cls(settings.max_jobs_per_minute, settings.max_stored_bytes, settings.max_cpu_s_per_day)


@dataclass(frozen=True)
class Used:
    """What an owner uses now.

    Attributes:
        queued_jobs: Jobs that wait.
        jobs_per_minute: Jobs accepted in this minute.
        stored_bytes: Objects, uploaded hands and results together [bytes].
        cpu_s_per_day: CPU time of workers today, UTC [s].
        minute_ends: When the minute ends [s since 1970].
        day_ends: When the day ends [s since 1970].
    """

    queued_jobs: int
    jobs_per_minute: int
    stored_bytes: int
    cpu_s_per_day: float
    minute_ends: float
    day_ends: float


class UsageStore(Store):
    """What owners use."""

    @reading
    def used(self, connection: sa.Connection, owner: str) -> Used:
        """What an owner uses now."""
        now = time.time()
        waiting = sa.select(sa.func.count()).where(jobs.c.owner == owner, QUEUED)
        return Used(
            queued_jobs=connection.execute(waiting).scalar_one(),
            jobs_per_minute=int(_amount(connection, owner, "jobs", _start(now, _MINUTE))),
            stored_bytes=_stored(connection, owner),
            cpu_s_per_day=_amount(connection, owner, "cpu_s", _start(now, _DAY)),
            minute_ends=_start(now, _MINUTE) + _MINUTE,
            day_ends=_start(now, _DAY) + _DAY,
        )

    @reading
    def check(self, connection: sa.Connection, owner: str, limits: Limits) -> None:
        """Refuse more work for an owner.

        Raises:
            LimitReached: It has used what it may.
        """
        refuse_excess(connection, owner, limits)

    @transaction
    def add_cpu(self, connection: sa.Connection, seconds: Mapping[str, float]) -> None:
        """Count CPU time by owner [s]."""
        now = time.time()
        for owner, amount in seconds.items():
            _count(connection, owner, "cpu_s", _start(now, _DAY), amount)

    @transaction
    def forget_before(self, connection: sa.Connection, now: float) -> None:
        """Delete what was counted long ago."""
        connection.execute(sa.delete(usage).where(usage.c.start < now - _KEPT))
        connection.execute(sa.delete(usage).where(usage.c.kind == "jobs", usage.c.start < now - _DAY))


def refuse_excess(connection: sa.Connection, owner: str, limits: Limits, new_jobs: int = 0) -> None:
    """Refuse what goes beyond an owner's limits.

    Raises:
        LimitReached: It does.
    """
    now = time.time()
    if limits.jobs_per_minute is not None and new_jobs:
        end, limit = _start(now, _MINUTE) + _MINUTE, limits.jobs_per_minute
        used = int(_amount(connection, owner, "jobs", end - _MINUTE))
        if used + new_jobs > limit:
            raise LimitReached(
                f"{used} of your jobs were accepted in this minute, and at most {limit} may; more from {_utc(end)}.",
                limit,
                end,
            )
    if limits.cpu_s_per_day is not None:
        end, most = _start(now, _DAY) + _DAY, limits.cpu_s_per_day
        spent = _amount(connection, owner, "cpu_s", end - _DAY)
        if spent >= most:
            raise LimitReached(
                f"You have used {spent:.0f} s of CPU time today, and may use {most:g} s a day; more from {_utc(end)}.",
                most,
                end,
            )
    if limits.stored_bytes is not None and (kept := _stored(connection, owner)) >= limits.stored_bytes:
        raise LimitReached(
            f"Your objects, hands and results take {kept} bytes, and may take {limits.stored_bytes}; "
            f"delete some first.",
            limits.stored_bytes,
            None,
        )


def count_jobs(connection: sa.Connection, owner: str, count: int) -> None:
    """Count accepted jobs of an owner."""
    _count(connection, owner, "jobs", _start(time.time(), _MINUTE), count)


def _count(connection: sa.Connection, owner: str, kind: str, start: int, amount: float) -> None:
    row = {"owner": owner, "kind": kind, "start": start, "amount": amount}
    connection.execute(_ADD[connection.dialect.name], row)


def _amount(connection: sa.Connection, owner: str, kind: str, start: int) -> float:
    which = (usage.c.owner == owner) & (usage.c.kind == kind) & (usage.c.start == start)
    return connection.execute(sa.select(usage.c.amount).where(which)).scalar() or 0.0


def _stored(connection: sa.Connection, owner: str) -> int:
    total = 0
    for column, table in ((objects.c.bytes, objects), (hands.c.bytes, hands), (jobs.c.result_bytes, jobs)):
        total += int(connection.execute(sa.select(sa.func.sum(column)).where(table.c.owner == owner)).scalar() or 0)
    return total


def _start(now: float, period: int) -> int:
    return int(now // period) * period


def _utc(moment: float) -> str:
    return f"{datetime.fromtimestamp(moment, UTC):%Y-%m-%dT%H:%M:%SZ}"
