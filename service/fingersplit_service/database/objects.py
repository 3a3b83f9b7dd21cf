"""Objects and their parallel grasps, as they stand in the database."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import sqlalchemy as sa

from fingersplit_client.schemas import ObjectInfo, ParallelGraspSetInfo
from fingersplit_service.database.store import Store, accepting, insert_missing, reading
from fingersplit_service.database.tables import jobs, objects, parallel_grasp_sets, uploads

__all__ = ["ObjectStore", "Removal", "StoredObject"]

_AT_ONCE = 500  # ids in one statement


@dataclass(frozen=True)
class StoredObject:
    """An object's place in the list and its document, JSON."""

    number: int
    document: str


@dataclass(frozen=True)
class Removal:
    """What became of an attempt to delete an object.

    Attributes:
        found: Whether it was there.
        unfinished: Jobs that still need it; with any, nothing was deleted.
    """

    found: bool
    unfinished: int = 0


class ObjectStore(Store):
    """Objects by owner: the same mesh of two owners is two rows and one file."""

    @accepting
    def add(self, connection: sa.Connection, owner: str, info: ObjectInfo, size: int = 0) -> bool:
        """Keep an object whose file has ``size`` bytes; False when its owner has it already."""
        row = {
            "owner": owner,
            "id": info.id,
            "name": info.name,
            "document": info.model_dump_json(),
            "created_at": info.created_at.timestamp(),
            "used_at": time.time(),
            "bytes": size,
        }
        if insert_missing(connection, objects, row, ["owner", "id"]):
            return True
        connection.execute(sa.update(objects).where(_is(owner, info.id)).values(used_at=row["used_at"]))
        return False

    @accepting
    def restate(self, connection: sa.Connection, owner: str, info: ObjectInfo, name: str) -> None:
        """Keep what the latest file of an object is like, and a name if one was given.

        Jobs keep the name that it had when they were accepted.
        """
        document = connection.execute(sa.select(objects.c.document).where(_is(owner, info.id))).scalar()
        if document is not None:
            known = ObjectInfo.model_validate_json(document)
            latest = info.model_copy(update={"name": name or known.name, "created_at": known.created_at})
            values = {"name": latest.name, "document": latest.model_dump_json()}
            connection.execute(sa.update(objects).where(_is(owner, info.id)).values(values))

    @reading
    def document(self, connection: sa.Connection, owner: str, object_id: str) -> str | None:
        """An object's document, JSON; None when the owner has no such object."""
        return connection.execute(sa.select(objects.c.document).where(_is(owner, object_id))).scalar()

    @accepting
    def note_upload(self, connection: sa.Connection, owner: str, key: str, object_id: str) -> None:
        """Remember which object a file became; ``key`` stands for the file and what was said of it."""
        row = {"owner": owner, "key": key, "object_id": object_id}
        insert_missing(connection, uploads, row, ["owner", "key"])

    @reading
    def uploaded(self, connection: sa.Connection, owner: str, key: str) -> str | None:
        """Document of the object that a file became, JSON; None when its owner has no such object."""
        same = (uploads.c.owner == objects.c.owner) & (uploads.c.object_id == objects.c.id)
        query = sa.select(objects.c.document).join(uploads, same).where(uploads.c.owner == owner, uploads.c.key == key)
        return connection.execute(query).scalar()

    @reading
    def page(self, connection: sa.Connection, owner: str, before: int | None, limit: int) -> list[StoredObject]:
        """Objects of an owner, newest first, older than the place ``before``."""
        query = sa.select(objects.c.number, objects.c.document).where(objects.c.owner == owner)
        if before is not None:
            query = query.where(objects.c.number < before)
        rows = connection.execute(query.order_by(objects.c.number.desc()).limit(limit))
        return [StoredObject(*row) for row in rows]

    @accepting
    def remove(self, connection: sa.Connection, owner: str, object_id: str) -> Removal:
        """Delete an object and its parallel grasps, unless unfinished jobs need it."""
        connection.execute(sa.select(objects.c.id).where(_is(owner, object_id)).with_for_update())  # none is added now
        unfinished = connection.execute(
            sa.select(sa.func.count())
            .select_from(jobs)
            .where(jobs.c.owner == owner, jobs.c.object_id == object_id, jobs.c.state.in_(("queued", "running")))
        ).scalar_one()
        if unfinished:
            return Removal(found=True, unfinished=unfinished)
        found = connection.execute(sa.delete(objects).where(_is(owner, object_id))).rowcount == 1
        connection.execute(sa.delete(parallel_grasp_sets).where(_has_grasps(owner, object_id)))
        connection.execute(sa.delete(uploads).where(uploads.c.owner == owner, uploads.c.object_id == object_id))
        return Removal(found=found)

    @reading
    def without_rows(self, connection: sa.Connection, object_ids: Sequence[str]) -> list[str]:
        """Those of some ids that no owner has an object of."""
        known = set[str]()
        for start in range(0, len(object_ids), _AT_ONCE):
            some = object_ids[start : start + _AT_ONCE]
            known |= set(connection.execute(sa.select(objects.c.id).where(objects.c.id.in_(some))).scalars())
        return [object_id for object_id in object_ids if object_id not in known]

    @reading
    def unused_since(self, connection: sa.Connection, moment: float, limit: int) -> Sequence[tuple[str, str]]:
        """Owner and id of objects that nobody uploaded or planned for since ``moment``."""
        query = sa.select(objects.c.owner, objects.c.id).where(objects.c.used_at < moment).limit(limit)
        return [(owner, object_id) for owner, object_id in connection.execute(query)]

    @accepting
    def add_grasps(self, connection: sa.Connection, owner: str, info: ParallelGraspSetInfo, document: str) -> bool:
        """Keep a set of parallel grasps; False when its object has gone."""
        if connection.execute(sa.select(objects.c.id).where(_is(owner, info.object_id))).scalar() is None:
            return False
        row = info.model_dump() | {
            "owner": owner,
            "created_at": info.created_at.timestamp(),
            "document": document,
        }
        connection.execute(sa.insert(parallel_grasp_sets).values(row))
        return True

    @reading
    def grasp_sets(self, connection: sa.Connection, owner: str, object_id: str) -> Sequence[sa.RowMapping]:
        """The sets of an object without their grasps, newest first."""
        columns = [column for column in parallel_grasp_sets.c if column.name in ParallelGraspSetInfo.model_fields]
        query = sa.select(*columns).where(_has_grasps(owner, object_id)).order_by(parallel_grasp_sets.c.number.desc())
        return connection.execute(query.limit(1000)).mappings().all()

    @reading
    def grasp_set(self, connection: sa.Connection, owner: str, object_id: str, set_id: str) -> sa.RowMapping | None:
        """One set with its ``document``."""
        query = sa.select(parallel_grasp_sets).where(_has_grasps(owner, object_id), parallel_grasp_sets.c.id == set_id)
        return connection.execute(query).mappings().one_or_none()

    @accepting
    def remove_grasps(self, connection: sa.Connection, owner: str, object_id: str, set_id: str) -> bool:
        """Delete a set; False when there is none."""
        which = _has_grasps(owner, object_id) & (parallel_grasp_sets.c.id == set_id)
        return connection.execute(sa.delete(parallel_grasp_sets).where(which)).rowcount == 1


def _is(owner: str, object_id: str) -> sa.ColumnElement[bool]:
    return (objects.c.owner == owner) & (objects.c.id == object_id)


def _has_grasps(owner: str, object_id: str) -> sa.ColumnElement[bool]:
    return (parallel_grasp_sets.c.owner == owner) & (parallel_grasp_sets.c.object_id == object_id)
