"""Outcomes of grasps by owner; nobody finds another's."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import sqlalchemy as sa

from fingersplit_client.schemas import GraspOutcome
from fingersplit_service.database.store import Store, accepting, reading
from fingersplit_service.database.tables import grasp_outcomes as table

__all__ = ["OutcomeFilter", "OutcomeStore", "Prediction", "StoredOutcome"]


class StoredOutcome(NamedTuple):
    """An outcome's place in the list, its document, JSON, and the planned grasp, JSON."""

    number: int
    document: str
    grasp: str


class Prediction(NamedTuple):
    """What was predicted of a grasp, and whether it held."""

    p_hold: float | None
    held: bool


@dataclass(frozen=True)
class OutcomeFilter:
    """Which outcomes of an owner to list; None means any."""

    job_id: str | None = None
    object_id: str | None = None
    hand: str | None = None
    rank: int | None = None

    def condition(self, owner: str) -> sa.ColumnElement[bool]:
        """As SQL."""
        wanted = {"job_id": self.job_id, "object_id": self.object_id, "hand": self.hand, "rank": self.rank}
        return sa.and_(
            table.c.owner == owner, *(table.c[k] == value for k, value in wanted.items() if value is not None)
        )


class OutcomeStore(Store):
    """What robots reported."""

    @accepting
    def add(self, connection: sa.Connection, owner: str, outcome: GraspOutcome, grasp: str) -> None:
        """Keep an outcome with the grasp as it was planned, JSON."""
        columns = outcome.model_dump(include={"id", "job_id", "rank", "object_id", "hand", "held", "p_hold"})
        row = columns | {"owner": owner, "document": outcome.model_dump_json(), "grasp": grasp}
        connection.execute(sa.insert(table).values(row))

    @reading
    def page(
        self, connection: sa.Connection, owner: str, which: OutcomeFilter, before: int | None, limit: int
    ) -> list[StoredOutcome]:
        """Outcomes of an owner, newest first, older than the place ``before``."""
        query = sa.select(table.c.number, table.c.document, table.c.grasp).where(which.condition(owner))
        if before is not None:
            query = query.where(table.c.number < before)
        return [StoredOutcome(*row) for row in connection.execute(query.order_by(table.c.number.desc()).limit(limit))]

    @reading
    def predictions(self, connection: sa.Connection, owner: str, which: OutcomeFilter) -> Sequence[Prediction]:
        """What was predicted of all of them, and what happened."""
        query = sa.select(table.c.p_hold, table.c.held).where(which.condition(owner))
        return [Prediction(*row) for row in connection.execute(query)]

    @accepting
    def delete(self, connection: sa.Connection, owner: str, outcome_id: str) -> bool:
        """Delete an outcome; False when the owner has no such outcome."""
        which = (table.c.owner == owner) & (table.c.id == outcome_id)
        return connection.execute(sa.delete(table).where(which)).rowcount == 1
