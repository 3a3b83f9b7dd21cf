"""Objects as the endpoints see them: keep an upload, find it again, export, delete."""

import asyncio
import hashlib
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from fingersplit.errors import ObjectFileError, SceneError
from fingersplit_client.schemas import ObjectInfo, ObjectLookup, ViewedScene
from fingersplit_service.database.objects import ObjectStore, StoredObject
from fingersplit_service.jobs.errors import InvalidField, InvalidFile, NotFound, ObjectInUse, ResourceGone
from fingersplit_service.jobs.object_work import Upload, ViewUpload
from fingersplit_service.jobs.reading import read_file
from fingersplit_service.jobs.usage import UsageService
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["ObjectService"]

Returned = TypeVar("Returned")
_FIELDS = {"needless_viewpoint": "/viewpoint", "needless_support": "/support", "below_support": "/support"}
"""What is at fault where it is not the file."""
_CLAIMS = 3  # attempts to keep an upload whose file clean-up removes at the same moment


class ObjectService:
    """What can be done with objects; every method acts for one owner.

    Args:
        objects: The table.
        storage: Their files.
        pool: The workers that read files.
        functions: What workers run.
        settings: Deadlines.
        usage: What owners may.
    """

    def __init__(
        self,
        objects: ObjectStore,
        storage: Storage,
        pool: WorkerPool,
        functions: WorkerFunctions,
        settings: ServiceSettings,
        usage: UsageService,
    ) -> None:
        self._objects, self._storage, self._pool = objects, storage, pool
        self._functions, self._settings, self._usage = functions, settings, usage

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
        return ObjectInfo.model_validate_json(await self.document(owner, object_id))

    async def page(self, owner: str, before: int | None, limit: int) -> list[StoredObject]:
        """Objects of an owner, newest first, older than the place ``before``."""
        return await self._objects.page(owner, before, limit)

    async def mesh_file(self, owner: str, object_id: str, file_type: str) -> Path:
        """The checked mesh as a file, object frame, in metres.

        Raises:
            NotFound: The owner has no such object.
        """
        await self.document(owner, object_id)
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

    async def document(self, owner: str, object_id: str) -> str:
        """What the table keeps of an object: ``ObjectInfo``, JSON. Raises as `get`."""
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

    async def _read_file(self, owner: str, function: Callable[..., Returned], *arguments: Any) -> Returned:
        deadline = self._settings.inspection_deadline_s
        return await read_file(self._pool, owner, deadline, function, self._storage, *arguments)


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
