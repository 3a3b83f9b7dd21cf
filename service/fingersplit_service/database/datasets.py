"""Data sets by owner, and the rounds that fill them; nobody finds another's."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import sqlalchemy as sa

from fingersplit_client.schemas import DatasetState
from fingersplit_service.database.store import Store, accepting, insert_missing, reading, transaction
from fingersplit_service.database.tables import dataset_rounds as rounds
from fingersplit_service.database.tables import datasets

__all__ = ["DatasetRow", "DatasetStore", "RoundRow"]


@dataclass(frozen=True)
class DatasetRow:
    """A data set: ``request`` and ``objects`` are JSON text, times are seconds since 1970, UTC."""

    number: int
    owner: str
    id: str
    state: DatasetState
    request: str
    objects: str
    created_at: float
    finished_at: float | None


@dataclass(frozen=True)
class RoundRow:
    """A round of an object: ``open`` while its job has not ended, then ``planned`` or ``failed``."""

    dataset_id: str
    object_index: int
    round: int
    job_id: str
    missing: int
    state: str = "open"
    grasps: int = 0
    feasible: int = 0
    held: int = 0
    selected: int = 0
    error_code: str | None = None
    error_detail: str | None = None


class DatasetStore(Store):
    """What was asked for, and what has been planned of it."""

    @accepting
    def add(self, connection: sa.Connection, row: Mapping[str, Any]) -> DatasetRow:
        """Keep a data set that is to be filled."""
        known = {**row, "state": "running", "created_at": time.time()}
        insert = sa.insert(datasets).values(known).returning(*datasets.c)
        return _dataset(connection.execute(insert).mappings().one())

    @reading
    def get(self, connection: sa.Connection, owner: str, dataset_id: str) -> DatasetRow | None:
        """A data set; None when the owner has no such one."""
        found = connection.execute(sa.select(datasets).where(_is(owner, dataset_id))).mappings().one_or_none()
        return None if found is None else _dataset(found)

    @reading
    def page(self, connection: sa.Connection, owner: str, before: int | None, limit: int) -> list[DatasetRow]:
        """Data sets of an owner, newest first, older than the place ``before``."""
        query = sa.select(datasets).where(datasets.c.owner == owner)
        if before is not None:
            query = query.where(datasets.c.number < before)
        found = connection.execute(query.order_by(datasets.c.number.desc()).limit(limit)).mappings()
        return [_dataset(row) for row in found]

    @reading
    def running(self, connection: sa.Connection) -> list[DatasetRow]:
        """Data sets of all owners that are being filled, oldest first."""
        query = sa.select(datasets).where(datasets.c.state == "running").order_by(datasets.c.number)
        return [_dataset(row) for row in connection.execute(query).mappings()]

    @reading
    def rounds(self, connection: sa.Connection, dataset_id: str) -> list[RoundRow]:
        """The rounds of a data set, by object and number."""
        query = sa.select(rounds).where(rounds.c.dataset_id == dataset_id)
        found = connection.execute(query.order_by(rounds.c.object_index, rounds.c.round)).mappings()
        return [RoundRow(**row) for row in found]

    @accepting
    def begin(self, connection: sa.Connection, row: RoundRow) -> None:
        """Note that a round was queued, unless that is known."""
        insert_missing(connection, rounds, asdict(row), ["dataset_id", "object_index", "round"])

    @accepting
    def end(self, connection: sa.Connection, ended: Sequence[RoundRow]) -> None:
        """Note what became of rounds."""
        for row in ended:
            same = [rounds.c[name] == getattr(row, name) for name in ("dataset_id", "object_index", "round")]
            connection.execute(sa.update(rounds).where(*same).values(asdict(row)))

    @accepting
    def finish(self, connection: sa.Connection, dataset_id: str, state: DatasetState) -> None:
        """Bring a data set that is being filled to its final state."""
        which = (datasets.c.id == dataset_id) & (datasets.c.state == "running")
        connection.execute(sa.update(datasets).where(which).values(state=state, finished_at=time.time()))

    @accepting
    def delete(self, connection: sa.Connection, owner: str, dataset_id: str) -> bool:
        """Delete a data set with its rounds; False when the owner has no such one."""
        found = connection.execute(sa.delete(datasets).where(_is(owner, dataset_id))).rowcount == 1
        if found:
            connection.execute(sa.delete(rounds).where(rounds.c.dataset_id == dataset_id))
        return found

    @transaction
    def delete_finished_before(self, connection: sa.Connection, moment: float) -> None:
        """Delete data sets that were finished before ``moment`` [s since 1970]; their jobs are deleted then as well."""
        old = sa.select(datasets.c.id).where(datasets.c.finished_at < moment)
        connection.execute(sa.delete(rounds).where(rounds.c.dataset_id.in_(old)))
        connection.execute(sa.delete(datasets).where(datasets.c.finished_at < moment))


def _dataset(row: Mapping[Any, Any]) -> DatasetRow:
    return DatasetRow(**row)


def _is(owner: str, dataset_id: str) -> sa.ColumnElement[bool]:
    return (datasets.c.owner == owner) & (datasets.c.id == dataset_id)
