"""Objects as the endpoints see them: keep an upload, find parallel grasps, export, delete."""

import asyncio
import hashlib
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, TypeVar
from uuid import uuid4

from pydantic import TypeAdapter

from fingersplit.errors import (
    FingersplitError,
    FormatError,
    ObjectFileError,
    ParallelGraspError,
    SceneError,
    SettingsError,
)
from fingersplit_client.schemas import (
    ObjectInfo,
    ObjectLookup,
    ParallelGrasp,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
    ViewedScene,
)
from fingersplit_service.database.objects import ObjectStore, StoredObject
from fingersplit_service.jobs.errors import InvalidField, InvalidFile, NotFound, ObjectInUse, ResourceGone
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.job_requests import check_grasps, check_hand, check_source
from fingersplit_service.jobs.reading import read_file
from fingersplit_service.jobs.usage import UsageService
from fingersplit_service.jobs.worker_functions import GraspFile, Upload, ViewUpload, WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["ObjectService"]

Returned = TypeVar("Returned")
_GRASPS = TypeAdapter(list[ParallelGrasp])
_FIELDS = {"needless_viewpoint": "/viewpoint", "needless_support": "/support", "below_support": "/support"}
"""What is at fault where it is not the file."""
_CLAIMS = 3  # attempts to keep an upload whose file clean-up removes at the same moment


class ObjectService:
    """What can be done with objects and their parallel grasps; every method acts for one owner.

    Args:
        objects: The table.
        storage: Their files.
        pool: The workers that read files.
        functions: What workers run.
        hands: The hands that are known.
        settings: Deadlines.
        usage: What owners may.
    """

    def __init__(
        self,
        objects: ObjectStore,
        storage: Storage,
        pool: WorkerPool,
        functions: WorkerFunctions,
        hands: HandCatalog,
        settings: ServiceSettings,
        usage: UsageService,
    ) -> None:
        self._usage = usage
        self._objects, self._storage, self._pool = objects, storage, pool
        self._functions, self._hands, self._settings = functions, hands, settings

    async def add(self, owner: str, name: str, file_name: str, upload: Upload) -> tuple[ObjectInfo, bool]:
        """Check an uploaded file and keep what is in it; the object, and whether the owner had it not yet.

        Of an object that was there, the report and the unit become those of this file, and so does a name that is
        given; without one it keeps the name that it has.

        Args:
            owner: Whose it is.
            name: Name for people, empty to take the file's.
            file_name: What the file is called.
            upload: The file.

        Raises:
            InvalidField: An option does not fit the file.
            InvalidFile: It holds no graspable object.
            LimitReached: The owner has used what it may.
        """
        await self._usage.admit(owner)
        for _ in range(_CLAIMS):
            found = await self._inspect(owner, upload)
            info = ObjectInfo(name=name or file_name, unit=upload.unit, created_at=datetime.now(UTC), **found)
            fresh, there = await self._keep_object(owner, info)
            if there:
                break
        else:
            raise ResourceGone(f"The file of object {info.id} was removed by clean-up; upload it again.")
        await self._objects.note_upload(owner, _upload_key(await asyncio.to_thread(_description, upload)), info.id)
        if not fresh:
            await self._objects.restate(owner, info, name)
            return await self.get(owner, info.id), False
        deadline = self._settings.plan_deadline_s
        self._pool.run_idly(self._functions.decompose, self._storage, info.id, deadline_s=deadline)
        return info, True

    async def add_view(self, owner: str, name: str, view: ViewUpload) -> ViewedScene:
        """Cut a depth image into a target, which is kept like any object, and the scene around it.

        Raises:
            InvalidField: An entry of the view cannot be used.
            InvalidFile: What the mask shows is no graspable object.
            LimitReached: The owner has used what it may.
        """
        await self._usage.admit(owner)
        for _ in range(_CLAIMS):
            found, rest = await self._cut(owner, view)
            info = ObjectInfo(name=name, unit="m", created_at=datetime.now(UTC), **found)
            _, there = await self._keep_object(owner, info)
            if there:
                return ViewedScene(object=await self.get(owner, info.id), **rest)
        raise ResourceGone(f"The file of object {info.id} was removed by clean-up; send the image again.")

    async def _keep_object(self, owner: str, info: ObjectInfo) -> tuple[bool, bool]:
        """Note an object whose file a worker has written: whether its owner had it not yet, and whether it is there."""
        shape = self._storage.shape(info.id)
        size = shape.stat().st_size if shape.exists() else 0
        fresh = await self._objects.add(owner, info, size)
        return fresh, await asyncio.to_thread(self._storage.exists, shape)

    async def find(self, owner: str, lookup: ObjectLookup) -> ObjectInfo:
        """The object that a file became when its owner uploaded it with these options.

        Raises:
            NotFound: The owner did not, or has deleted it.
        """
        document = await self._objects.uploaded(owner, _upload_key(lookup))
        if document is None:
            raise NotFound("This file is not known with these options; upload it to /v1/objects.")
        return ObjectInfo.model_validate_json(document)

    async def get(self, owner: str, object_id: str) -> ObjectInfo:
        """One object.

        Raises:
            NotFound: The owner has no such object.
        """
        return ObjectInfo.model_validate_json(await self._document(owner, object_id))

    async def page(self, owner: str, before: int | None, limit: int) -> list[StoredObject]:
        """Objects of an owner, newest first, older than the place ``before``."""
        return await self._objects.page(owner, before, limit)

    async def mesh_file(self, owner: str, object_id: str, file_type: str) -> Path:
        """The checked mesh as a file, object frame, in metres.

        Raises:
            NotFound: The owner has no such object.
        """
        await self._document(owner, object_id)
        path = self._storage.mesh_export(object_id, file_type)
        try:
            await asyncio.to_thread(self._storage.local, path)
        except FileNotFoundError:
            deadline = self._settings.picture_deadline_s
            arguments = self._functions.export, self._storage, object_id, file_type
            await self._pool.answer(owner, *arguments, deadline_s=deadline, object_id=object_id)
        return path

    async def delete(self, owner: str, object_id: str) -> None:
        """Delete an object and its parallel grasps; clean-up removes its files once nobody has it.

        Raises:
            NotFound: The owner has no such object.
            ObjectInUse: Jobs that have not ended need it.
        """
        removal = await self._objects.remove(owner, object_id)
        if removal.unfinished:
            raise ObjectInUse(
                f"{removal.unfinished} jobs that have not ended need object {object_id}; cancel them first."
            )
        if not removal.found:
            raise NotFound(f"There is no object {object_id!r}.")

    async def generate_grasps(self, owner: str, object_id: str, request: ParallelGraspsGenerate) -> ParallelGraspSet:
        """Find two-contact grasps of an object that fit a hand's opening, and keep them as a set.

        Raises:
            NotFound: The owner has no such object.
            InvalidField: Unknown hand, or settings with which nothing can be found.
            LimitReached: The owner has used what it may.
        """
        await self._document(owner, object_id)
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

    async def add_grasps(self, owner: str, object_id: str, name: str, grasps: list[ParallelGrasp]) -> ParallelGraspSet:
        """Keep parallel grasps that were found elsewhere as a set.

        Raises:
            NotFound: The owner has no such object.
            InvalidField: One of them is none, or does not touch the object; the field says which.
        """
        await self._document(owner, object_id)
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
        await self._document(owner, object_id)
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

    async def import_grasps(
        self, owner: str, object_id: str, name: str, file: GraspFile
    ) -> tuple[ParallelGraspSet, str]:
        """Keep the parallel grasps in a file as a set; the set, and a sentence on what the file held.

        Raises:
            NotFound: The owner has no such object.
            InvalidFile: The file holds no grasps of it.
        """
        object_name = (await self.get(owner, object_id)).name
        try:
            found, message = await self._read_file(
                owner, self._functions.import_grasps, object_id, object_name, file, object_id=object_id
            )
        except (FormatError, SettingsError) as error:
            raise InvalidFile(str(error)) from error
        kept = await self._keep(owner, object_id, "imported", name, _GRASPS.validate_python(found))
        return kept, message

    async def grasp_sets(self, owner: str, object_id: str) -> list[ParallelGraspSetInfo]:
        """The sets of an object without their grasps, newest first; the newest thousand.

        Raises:
            NotFound: The owner has no such object.
        """
        await self._document(owner, object_id)
        rows = await self._objects.grasp_sets(owner, object_id)
        return [ParallelGraspSetInfo.model_validate(_set_info(row)) for row in rows]

    async def grasp_set(self, owner: str, object_id: str, set_id: str) -> ParallelGraspSet:
        """One set with its grasps.

        Raises:
            NotFound: The owner's object has no such set.
        """
        row = await self._objects.grasp_set(owner, object_id, set_id)
        if row is None:
            raise _unknown_set(object_id, set_id)
        return ParallelGraspSet(parallel_grasps=_GRASPS.validate_json(row["document"]), **_set_info(row))

    async def delete_grasp_set(self, owner: str, object_id: str, set_id: str) -> None:
        """Delete a set; jobs that started from it stay as they are.

        Raises:
            NotFound: The owner's object has no such set.
        """
        if not await self._objects.remove_grasps(owner, object_id, set_id):
            raise _unknown_set(object_id, set_id)

    async def _document(self, owner: str, object_id: str) -> str:
        document = await self._objects.document(owner, object_id)
        if document is None:
            raise NotFound(f"There is no object {object_id!r}; upload its mesh to /v1/objects.")
        return document

    async def _inspect(self, owner: str, upload: Upload) -> dict[str, Any]:
        """What a worker says of an uploaded file."""
        try:
            return await self._read_file(owner, self._functions.inspect, upload)
        except ObjectFileError as error:
            if error.code in _FIELDS:
                raise InvalidField(_FIELDS[error.code], str(error), code=error.code) from error
            raise InvalidFile(str(error), code=error.code, mesh=True) from error
        except InvalidFile as error:
            error.mesh = True
            raise

    async def _cut(self, owner: str, view: ViewUpload) -> tuple[dict[str, Any], dict[str, Any]]:
        """What a worker makes of a view."""
        try:
            return await self._read_file(owner, self._functions.cut_view, view)
        except SceneError as error:
            raise InvalidField(f"/{error.field}", str(error)) from error
        except ObjectFileError as error:
            raise InvalidFile(str(error), code=error.code, mesh=True) from error

    async def _read_file(
        self, owner: str, function: Callable[..., Returned], *arguments: Any, object_id: str | None = None
    ) -> Returned:
        deadline = self._settings.inspection_deadline_s
        return await read_file(self._pool, owner, deadline, function, self._storage, *arguments, object_id=object_id)

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
        if not await self._objects.add_grasps(owner, info, _GRASPS.dump_json(grasps).decode()):
            raise NotFound(f"Object {object_id!r} was deleted meanwhile.")
        return ParallelGraspSet(parallel_grasps=grasps, **info.model_dump())


def _set_info(row: Any) -> dict[str, Any]:
    members = {name: row[name] for name in ParallelGraspSetInfo.model_fields}
    return members | {"created_at": datetime.fromtimestamp(row["created_at"], UTC)}


def _unknown_set(object_id: str, set_id: str) -> NotFound:
    return NotFound(f"Object {object_id!r} has no set of parallel grasps {set_id!r}.")


def _description(upload: Upload) -> ObjectLookup:
    """What a client says of a file that it may have uploaded before."""
    with upload.path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
    return ObjectLookup(
        sha256=sha256,
        unit=upload.unit,
        scale=upload.scale,
        viewpoint=upload.viewpoint,
        support=upload.support,
        **upload.options,
    )


def _upload_key(lookup: ObjectLookup) -> str:
    return hashlib.sha256(lookup.model_dump_json().encode()).hexdigest()
