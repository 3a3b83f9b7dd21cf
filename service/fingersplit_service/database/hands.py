"""Uploaded hands, as they stand in the database."""

from collections.abc import Sequence

import sqlalchemy as sa

from fingersplit_client.schemas import HandInfo
from fingersplit_service.database.objects import Removal
from fingersplit_service.database.store import Store, accepting, insert_missing, reading
from fingersplit_service.database.tables import hands, jobs

__all__ = ["HandStore"]

_MAX_LISTED = 1000  # hands in a list


class HandStore(Store):
    """Hands by owner: the same files of two owners are two rows and one folder."""

    @accepting
    def add(self, connection: sa.Connection, owner: str, info: HandInfo, size: int) -> bool:
        """Keep a hand whose file has ``size`` bytes; False when its owner has it already."""
        assert info.created_at is not None  # of an uploaded hand
        row = {
            "owner": owner,
            "id": info.name,
            "document": info.model_dump_json(),
            "created_at": info.created_at.timestamp(),
            "bytes": size,
        }
        return insert_missing(connection, hands, row, ["owner", "id"])

    @reading
    def document(self, connection: sa.Connection, owner: str, hand_id: str) -> str | None:
        """The document of a hand; None when its owner has none of this id."""
        return connection.execute(sa.select(hands.c.document).where(_is(owner, hand_id))).scalar()

    @reading
    def documents(self, connection: sa.Connection, owner: str) -> Sequence[str]:
        """The documents of an owner's hands, newest first; the newest thousand."""
        query = sa.select(hands.c.document).where(hands.c.owner == owner).order_by(hands.c.number.desc())
        return connection.execute(query.limit(_MAX_LISTED)).scalars().all()

    @accepting
    def remove(self, connection: sa.Connection, owner: str, hand_id: str) -> Removal:
        """Delete a hand, unless unfinished jobs need it."""
        unfinished = connection.execute(
            sa.select(sa.func.count())
            .select_from(jobs)
            .where(jobs.c.owner == owner, jobs.c.hand == hand_id, jobs.c.state.in_(("queued", "running")))
        ).scalar_one()
        if unfinished:
            return Removal(found=True, unfinished=unfinished)
        return Removal(found=connection.execute(sa.delete(hands).where(_is(owner, hand_id))).rowcount == 1)

    @reading
    def without_rows(self, connection: sa.Connection, hand_ids: Sequence[str]) -> list[str]:
        """Those of some ids that no owner has a hand of."""
        known = set(connection.execute(sa.select(hands.c.id).where(hands.c.id.in_(hand_ids))).scalars())
        return [hand_id for hand_id in hand_ids if hand_id not in known]


def _is(owner: str, hand_id: str) -> sa.ColumnElement[bool]:
    return (hands.c.owner == owner) & (hands.c.id == hand_id)
