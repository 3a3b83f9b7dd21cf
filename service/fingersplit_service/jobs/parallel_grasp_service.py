"""Parallel grasps of objects as the endpoints see them: found, brought, checked, and kept as sets."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, Literal
from uuid import uuid4

from pydantic import TypeAdapter

from fingersplit.errors import FingersplitError, FormatError, ParallelGraspError, SettingsError
from fingersplit_client.schemas import ParallelGrasp, ParallelGraspSet, ParallelGraspSetInfo, ParallelGraspsGenerate
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.jobs.errors import InvalidField, InvalidFile, NotFound
from fingersplit_service.jobs.grasp_work import GraspFile
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.job_requests import check_grasps, check_hand, check_source
from fingersplit_service.jobs.object_service import ObjectService
from fingersplit_service.jobs.reading import read_file
from fingersplit_service.jobs.usage import UsageService
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["ParallelGraspService"]

_GRASPS = TypeAdapter(list[ParallelGrasp])


class ParallelGraspService:
    """What can be done with parallel grasps of an object; every method acts for one owner.

    Args:
        objects: The objects.
        sets: The table that keeps the sets.
        storage: The objects' files.
        pool: The workers that find and check grasps.
        functions: What workers run.
        hands: The hands that are known.
        settings: Deadlines.
        usage: What owners may.
    """

    def __init__(
        self,
        objects: ObjectService,
        sets: ObjectStore,
        storage: Storage,
        pool: WorkerPool,
        functions: WorkerFunctions,
        hands: HandCatalog,
        settings: ServiceSettings,
        usage: UsageService,
    ) -> None:
        self._objects, self._sets, self._usage = objects, sets, usage
        self._storage, self._pool = storage, pool
        self._functions, self._hands, self._settings = functions, hands, settings

    async def generate(self, owner: str, object_id: str, request: ParallelGraspsGenerate) -> ParallelGraspSet:
        """Find two-contact grasps of an object that fit a hand's opening, and keep them as a set.

        Raises:
            NotFound: The owner has no such object.
            InvalidField: Unknown hand, or settings with which nothing can be found.
            LimitReached: The owner has used what it may.
        """
        await self._objects.document(owner, object_id)
        await check_hand(self._hands, owner, request.hand)
        check_source(self._hands, request.source)
        await self._usage.admit(owner)
        try:
            found = await self._pool.answer(
                owner,
                self._functions.generate,
                self._storage,
                object_id,
                request,
                deadline_s=self._settings.picture_deadline_s,
                object_id=object_id,
            )
        except FingersplitError as error:
            raise InvalidField("", str(error)) from error
        return await self._keep(owner, object_id, "generated", request.name, _GRASPS.validate_python(found))

    async def add(self, owner: str, object_id: str, name: str, grasps: list[ParallelGrasp]) -> ParallelGraspSet:
        """Keep parallel grasps that were found elsewhere as a set.

        Raises:
            NotFound: The owner has no such object.
            InvalidField: One of them is none, or does not touch the object; the field says which.
        """
        await self._objects.document(owner, object_id)
        await self.check_touching(owner, object_id, grasps)
        return await self._keep(owner, object_id, "imported", name, grasps)

    async def check_touching(
        self, owner: str, object_id: str, grasps: Sequence[ParallelGrasp], prefix: str = ""
    ) -> None:
        """Refuse parallel grasps that are none, or that do not touch an object.

        Args:
            owner: Who gives them.
            object_id: The object.
            grasps: The grasps.
            prefix: Where they stand in the whole request, as a JSON pointer.

        Raises:
            NotFound: The owner has no such object.
            InvalidField: One of them is none, or lies off the surface; the field says which.
        """
        check_grasps(grasps, prefix)
        await self._objects.document(owner, object_id)
        documents = [grasp.model_dump() for grasp in grasps]
        deadline = self._settings.picture_deadline_s
        try:
            await self._pool.answer(
                owner,
                self._functions.check_touching,
                self._storage,
                object_id,
                documents,
                deadline_s=deadline,
                object_id=object_id,
            )
        except ParallelGraspError as error:
            raise InvalidField(f"{prefix}/parallel_grasps/{error.index}", str(error)) from error

    async def import_file(self, owner: str, object_id: str, name: str, file: GraspFile) -> tuple[ParallelGraspSet, str]:
        """Keep the parallel grasps in a file as a set; the set, and a sentence on what the file held.

        Raises:
            NotFound: The owner has no such object.
            InvalidFile: The file holds no grasps of it.
        """
        object_name = (await self._objects.get(owner, object_id)).name
        try:
            found, message = await read_file(
                self._pool,
                owner,
                self._settings.inspection_deadline_s,
                self._functions.import_grasps,
                self._storage,
                object_id,
                object_name,
                file,
                object_id=object_id,
            )
        except (FormatError, SettingsError) as error:
            raise InvalidFile(str(error)) from error
        kept = await self._keep(owner, object_id, "imported", name, _GRASPS.validate_python(found))
        return kept, message

    async def sets(self, owner: str, object_id: str) -> list[ParallelGraspSetInfo]:
        """The sets of an object without their grasps, newest first; the newest thousand.

        Raises:
            NotFound: The owner has no such object.
        """
        await self._objects.document(owner, object_id)
        rows = await self._sets.grasp_sets(owner, object_id)
        return [ParallelGraspSetInfo.model_validate(_set_info(row)) for row in rows]

    async def get(self, owner: str, object_id: str, set_id: str) -> ParallelGraspSet:
        """One set with its grasps.

        Raises:
            NotFound: The owner's object has no such set.
        """
        row = await self._sets.grasp_set(owner, object_id, set_id)
        if row is None:
            raise _unknown_set(object_id, set_id)
        return ParallelGraspSet(parallel_grasps=_GRASPS.validate_json(row["document"]), **_set_info(row))

    async def delete(self, owner: str, object_id: str, set_id: str) -> None:
        """Delete a set; jobs that started from it stay as they are.

        Raises:
            NotFound: The owner's object has no such set.
        """
        if not await self._sets.remove_grasps(owner, object_id, set_id):
            raise _unknown_set(object_id, set_id)

    async def _keep(
        self,
        owner: str,
        object_id: str,
        origin: Literal["generated", "imported"],
        name: str,
        grasps: list[ParallelGrasp],
    ) -> ParallelGraspSet:
        info = ParallelGraspSetInfo(
            id=uuid4().hex,
            object_id=object_id,
            origin=origin,
            name=name,
            count=len(grasps),
            created_at=datetime.now(UTC),
        )
        if not await self._sets.add_grasps(owner, info, _GRASPS.dump_json(grasps).decode()):
            raise NotFound(f"Object {object_id!r} was deleted meanwhile.")
        return ParallelGraspSet(parallel_grasps=grasps, **info.model_dump())


def _set_info(row: Any) -> dict[str, Any]:
    members = {name: row[name] for name in ParallelGraspSetInfo.model_fields}
    return members | {"created_at": datetime.fromtimestamp(row["created_at"], UTC)}


def _unknown_set(object_id: str, set_id: str) -> NotFound:
    return NotFound(f"Object {object_id!r} has no set of parallel grasps {set_id!r}.")
