"""Data sets as the endpoints see them: ask for one, see how far it is, get its shards, cancel, delete."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, cast
from uuid import uuid4

from fingersplit.dataset.request import MAX_ROUND, DatasetObject, DatasetRequest, divide, manifest_of
from fingersplit_client.schemas import Dataset, DatasetCreate, DatasetSummary, ObjectInfo
from fingersplit_client.schemas import DatasetError as DatasetFault
from fingersplit_client.schemas import DatasetObject as DatasetItem
from fingersplit_client.schemas import DatasetShard as ShardDocument
from fingersplit_service.database.datasets import DatasetRow, DatasetStore, RoundRow
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.jobs.dataset_rounds import missing_of, refusal_of, round_request
from fingersplit_service.jobs.dataset_shards import ShardTask
from fingersplit_service.jobs.errors import InvalidField, NotFound, ResourceGone
from fingersplit_service.jobs.job_service import JobService
from fingersplit_service.jobs.result_service import ResultService

__all__ = ["DatasetProgress", "DatasetService", "document_of", "shard_place", "summary_of"]

Split = Literal["train", "validation", "test"]
_OBJECT_FIELDS = ("density", "mass", "friction", "fairing")


@dataclass(frozen=True)
class DatasetProgress:
    """A data set and the rounds that were begun for it."""

    row: DatasetRow
    rounds: list[RoundRow]

    @property
    def request(self) -> DatasetCreate:
        """What was asked for."""
        return DatasetCreate.model_validate_json(self.row.request)

    @property
    def objects(self) -> list[DatasetObject]:
        """Its objects; the hash is their id."""
        return [DatasetObject(**item) for item in json.loads(self.row.objects)]

    def of(self, index: int) -> list[RoundRow]:
        """The rounds of an object, in order."""
        return [one for one in self.rounds if one.object_index == index]


class DatasetService:
    """What can be done with data sets; every method acts for one owner, and nobody finds another's.

    Args:
        store: Where they are.
        jobs: The jobs that plan their rounds.
        objects: Their objects.
        results: The results of these jobs.
        wake: Called when there is one to fill.
    """

    def __init__(
        self,
        store: DatasetStore,
        jobs: JobService,
        objects: ObjectStore,
        results: ResultService,
        wake: Callable[[], None],
    ) -> None:
        self._store, self._jobs, self._objects = store, jobs, objects
        self._results, self._wake = results, wake

    async def create(self, owner: str, asked: DatasetCreate) -> DatasetProgress:
        """Keep a data set; from now on it is filled, also after a restart.

        Raises:
            InvalidField: It could not be filled.
            WorkersNotReady: The hands are not known yet.
        """
        if asked.job.parallel_grasps is not None or asked.job.parallel_grasp_set is not None:
            raise InvalidField("/job/parallel_grasps", "Rounds find their parallel grasps; name a source instead.")
        if not sum(asked.split):
            raise InvalidField("/split", "At least one of the shares must be positive.")
        names = [await self._name(owner, place, object_id) for place, object_id in enumerate(asked.objects)]
        if len(set(asked.objects)) < len(asked.objects):
            raise InvalidField("/objects", "An object is named twice; it can be in a data set once.")
        first = round_request(asked, asked.objects[0], 0, min(asked.per_object, MAX_ROUND))
        await self._jobs.check(owner, first, "/job")
        parts = divide(asked.objects, asked.split)
        items = [
            DatasetObject(index, name, name, object_id, parts[object_id])
            for index, (object_id, name) in enumerate(zip(asked.objects, names, strict=True))
        ]
        objects = json.dumps([asdict(item) for item in items])
        row = {"id": uuid4().hex, "owner": owner, "request": asked.model_dump_json(), "objects": objects}
        kept = await self._store.add(row)
        self._wake()
        return DatasetProgress(kept, [])

    async def get(self, owner: str, dataset_id: str) -> DatasetProgress:
        """A data set as it stands.

        Raises:
            NotFound: The owner has no such one.
        """
        row = await self._store.get(owner, dataset_id)
        if row is None:
            raise NotFound(f"There is no data set {dataset_id!r}.")
        return DatasetProgress(row, await self._store.rounds(row.id))

    async def page(self, owner: str, before: int | None, limit: int) -> list[DatasetProgress]:
        """Data sets of an owner, newest first, older than the place ``before``."""
        rows = await self._store.page(owner, before, limit)
        return [DatasetProgress(row, await self._store.rounds(row.id)) for row in rows]

    async def cancel(self, owner: str, dataset_id: str) -> DatasetProgress:
        """Begin no more rounds, and end those that run; what was planned stays.

        Raises:
            NotFound: The owner has no such one.
        """
        found = await self.get(owner, dataset_id)
        await self._store.finish(found.row.id, "cancelled")
        if found.row.state == "running":
            with suppress(NotFound):  # no round has begun
                await self._jobs.cancel_batch(owner, dataset_id)
        return await self.get(owner, dataset_id)

    async def delete(self, owner: str, dataset_id: str) -> None:
        """Delete a data set with the jobs of its rounds.

        Raises:
            NotFound: The owner has no such one.
        """
        await self.cancel(owner, dataset_id)
        with suppress(NotFound):
            for job_id, _ in await self._jobs.batch(owner, dataset_id):
                await self._jobs.delete(owner, job_id)
        await self._store.delete(owner, dataset_id)

    async def manifest(self, owner: str, dataset_id: str) -> dict[str, Any]:
        """What ``dataset.json`` says, so that downloaded shards are a folder like one that was made on one machine.

        Raises:
            NotFound: The owner has no such one.
        """
        found = await self.get(owner, dataset_id)
        asked = found.request
        sources = [await self._about(owner, item.sha256) for item in found.objects]
        alike = {name: value for name, value in sources[0].items() if all(one[name] == value for one in sources)}
        job = asked.job.model_dump(mode="json")
        constraints = ("scene", "approach", "contact_regions", "task", "end_effector")
        same = ("hand", "starts", "seed", "protocol", "controller", "simulated_friction", "source", "planner")
        order = DatasetRequest(
            **alike,
            **{name: job[name] for name in same},
            per_object=asked.per_object,
            verified=asked.verified,
            max_rounds=asked.max_rounds,
            constraints={name: job[name] for name in constraints if job[name] is not None},
            split=asked.split,
            licence=asked.licence,
        )
        return manifest_of(order, found.objects)

    async def shard(self, owner: str, dataset_id: str, index: int, number: int) -> tuple[Path, str]:
        """The file of a round, made by a worker unless it is there, and its place in the folder.

        Raises:
            NotFound: No such data set, or no such round that has ended with a result.
            ResourceGone: Its job was deleted.
        """
        found = await self.get(owner, dataset_id)
        planned = {(one.object_index, one.round): one for one in found.rounds if one.state == "planned"}
        one = planned.get((index, number))
        if one is None:
            raise NotFound(f"Data set {dataset_id} has no planned round {number} of object {index}.")
        asked, item = found.request, found.objects[index]
        task = ShardTask(one.job_id, item, number, asked.verified, one.missing, asked.licence)
        try:
            return await self._results.shard(owner, task), shard_place(item, number)
        except NotFound as error:
            raise ResourceGone(f"The shard cannot be made any more: {error}") from error

    async def _name(self, owner: str, place: int, object_id: str) -> str:
        document = await self._objects.document(owner, object_id)
        if document is None:
            detail = f"There is no object {object_id!r}; upload it to /v1/objects first."
            raise InvalidField(f"/objects/{place}", detail)
        return ObjectInfo.model_validate_json(document).name

    async def _about(self, owner: str, object_id: str) -> dict[str, Any]:
        """What orders say of objects, of one; nothing of one that was deleted."""
        document = await self._objects.document(owner, object_id)
        if document is None:
            return dict.fromkeys(("unit", "scale", *_OBJECT_FIELDS))
        info = ObjectInfo.model_validate_json(document)
        options = info.options.model_dump(include=set(_OBJECT_FIELDS))
        return {"unit": info.unit, "scale": getattr(info.report, "scale", 1.0), **options}


def shard_place(item: DatasetObject, number: int) -> str:
    """Where a shard belongs in the folder of a data set."""
    return f"{item.split}/{item.label}.{number:04d}.h5"


def summary_of(found: DatasetProgress) -> DatasetSummary:
    """A data set as lists have it."""
    return DatasetSummary(**_counts(found, _items(found)))


def document_of(found: DatasetProgress) -> Dataset:
    """A data set with its objects and shards."""
    items = _items(found)
    return Dataset(**_counts(found, items), request=found.request, items=items)


def _counts(found: DatasetProgress, items: list[DatasetItem]) -> dict[str, Any]:
    row, asked = found.row, found.request
    return {
        "id": row.id,
        "name": asked.name,
        "state": row.state,
        "hand": asked.job.hand,
        "objects": len(items),
        "done": sum(item.done for item in items),
        "failed": sum(item.error is not None for item in items),
        "wanted": len(items) * asked.per_object,
        "selected": sum(item.selected for item in items),
        "feasible": sum(one.feasible for one in found.rounds),
        "held": sum(one.held for one in found.rounds),
        "created_at": datetime.fromtimestamp(row.created_at, UTC),
        "finished_at": None if row.finished_at is None else datetime.fromtimestamp(row.finished_at, UTC),
    }


def _items(found: DatasetProgress) -> list[DatasetItem]:
    asked, by_object = found.request, dict[int, list[RoundRow]]()
    for one in found.rounds:
        by_object.setdefault(one.object_index, []).append(one)
    items = []
    for item in found.objects:
        begun = by_object.get(item.index, [])
        refusal = refusal_of(asked, begun)
        shards = [
            ShardDocument(
                round=one.round,
                path=shard_place(item, one.round),
                job_id=one.job_id,
                grasps=one.grasps,
                selected=one.selected,
            )
            for one in begun
            if one.state == "planned"
        ]
        items.append(
            DatasetItem(
                index=item.index,
                object_id=item.sha256,
                name=item.name,
                split=cast(Split, item.split),
                selected=sum(one.selected for one in begun),
                done=refusal is not None or not missing_of(asked, begun),
                error=None if refusal is None else DatasetFault(code=refusal[0], detail=refusal[1]),
                shards=shards,
            )
        )
    return items
