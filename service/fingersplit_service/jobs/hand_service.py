"""Hands as the endpoints see them: those that ship, and those that an owner uploaded."""

import asyncio
import json
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fingersplit.errors import HandError, UnknownHandError
from fingersplit_client.schemas import HandDetail, HandInfo
from fingersplit_service.database.hands import HandStore
from fingersplit_service.jobs.errors import InvalidField, InvalidFile, NotFound, ObjectInUse, ResourceGone
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.hand_work import HandTask, HandUpload, HandViewName
from fingersplit_service.jobs.reading import read_file
from fingersplit_service.jobs.usage import UsageService
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["HandService"]


class HandService:
    """What can be done with hands; every method acts for one owner, who sees the shipped ones and its own.

    Args:
        hands: The table of uploaded hands.
        catalog: All hands that are known.
        storage: Their files.
        pool: The workers that compile them.
        functions: What workers run.
        settings: Deadlines.
        usage: What owners may.
    """

    def __init__(
        self,
        hands: HandStore,
        catalog: HandCatalog,
        storage: Storage,
        pool: WorkerPool,
        functions: WorkerFunctions,
        settings: ServiceSettings,
        usage: UsageService,
    ) -> None:
        self._hands, self._catalog, self._storage = hands, catalog, storage
        self._pool, self._functions, self._settings, self._usage = pool, functions, settings, usage

    async def all(self, owner: str) -> list[HandInfo]:
        """The shipped hands, then the owner's, newest first."""
        own = await self._hands.documents(owner)
        return [*self._catalog.shipped(), *map(HandInfo.model_validate_json, own)]

    async def add(self, owner: str, upload: HandUpload) -> tuple[HandDetail, bool]:
        """Compile and check an archive and keep the hand in it; the hand, and whether the owner had it not yet.

        Raises:
            InvalidFile: The archive is refused, or holds no hand that can be planned with.
            LimitReached: The owner has used what it may.
        """
        try:
            return await self._keep(owner, self._functions.add_hand, upload)
        except HandError as error:
            raise InvalidFile(str(error), code="unusable_hand") from error

    async def correct(self, owner: str, hand_id: str, description: str) -> tuple[HandDetail, bool]:
        """The files of an uploaded hand with another description, as a hand of its own; results as ``add``.

        Raises:
            NotFound: The owner has no such hand.
            InvalidField: With this description it is no hand that can be planned with.
            LimitReached: The owner has used what it may.
        """
        await self._uploaded(owner, hand_id)
        try:
            return await self._keep(owner, self._functions.correct_hand, hand_id, description)
        except HandError as error:
            raise InvalidField("/description", str(error), code="unusable_hand") from error
        except FileNotFoundError:
            raise ResourceGone(f"Hand {hand_id} was deleted meanwhile.") from None

    async def get(self, owner: str, name: str) -> HandDetail:
        """A hand with its description and the report of its check.

        Raises:
            NotFound: The owner knows no such hand.
        """
        info = await self._info(owner, name)
        said = json.loads(await self._read(owner, info, "report.json"))
        trial = None
        with suppress(FileNotFoundError):
            path = await asyncio.to_thread(self._storage.local, self._storage.hand_view(_key(info), "trial.json"))
            trial = json.loads(await asyncio.to_thread(path.read_text))
        return HandDetail(**info.model_dump(), **said, trial=trial)

    async def try_out(self, owner: str, name: str) -> HandDetail:
        """A hand with the plans for simple objects, which are made unless that was done before. Raises as `get`."""
        info = await self._info(owner, name)
        await self.view(owner, name, "trial.json")
        return await self.get(owner, info.name)

    async def view(self, owner: str, name: str, view: HandViewName) -> Path:
        """The file of a view, made by a worker unless it is there. Raises as `get`."""
        info = await self._info(owner, name)
        path = self._storage.hand_view(_key(info), view)
        with suppress(FileNotFoundError):
            return await asyncio.to_thread(self._storage.local, path)
        task = HandTask(view, info.name, _key(info))
        deadline = self._settings.hand_deadline_s
        try:
            await self._pool.answer(owner, self._functions.view_hand, self._storage, task, deadline_s=deadline)
        except UnknownHandError:
            raise ResourceGone(f"Hand {name} was deleted meanwhile.") from None
        return path

    async def delete(self, owner: str, hand_id: str) -> None:
        """Delete an uploaded hand; clean-up removes its files once nobody has it.

        Raises:
            NotFound: The owner has no such hand.
            InvalidField: It is one that ships.
            ObjectInUse: Jobs that have not ended need it.
        """
        if self._catalog.is_shipped(hand_id):
            raise InvalidField("hand_id", f"{hand_id} ships with the service and cannot be deleted.")
        removal = await self._hands.remove(owner, hand_id)
        if removal.unfinished:
            raise ObjectInUse(f"{removal.unfinished} jobs that have not ended need hand {hand_id}; cancel them first.")
        if not removal.found:
            raise _unknown(hand_id)

    async def _keep(self, owner: str, function: Any, *arguments: Any) -> tuple[HandDetail, bool]:
        """What a worker makes of files; the hand, and whether the owner had it not yet."""
        await self._usage.admit(owner)
        deadline = self._settings.hand_deadline_s
        found = await read_file(self._pool, owner, deadline, function, self._storage, *arguments)
        info = HandInfo(origin="uploaded", created_at=datetime.now(UTC), **found)
        file = self._storage.hand(info.name)
        fresh = await self._hands.add(owner, info, file.stat().st_size if file.exists() else 0)
        if not await asyncio.to_thread(self._storage.exists, file):
            raise ResourceGone(f"The files of hand {info.name} were removed by clean-up; upload them again.")
        return await self.get(owner, info.name), fresh

    async def _info(self, owner: str, name: str) -> HandInfo:
        info = await self._catalog.find(owner, name)
        if info is None:
            raise _unknown(name)
        return info

    async def _uploaded(self, owner: str, hand_id: str) -> None:
        if self._catalog.is_shipped(hand_id):
            raise InvalidField("hand_id", f"{hand_id} ships with the service; upload your own model to describe it.")
        await self._info(owner, hand_id)

    async def _read(self, owner: str, info: HandInfo, view: HandViewName) -> str:
        return await asyncio.to_thread((await self.view(owner, info.name, view)).read_text)


def _key(info: HandInfo) -> str:
    """Where a hand's views are kept: those of a shipped one change with the program."""
    return info.name if info.origin == "uploaded" else f"{info.name}-{info.sha256[:16]}"


def _unknown(name: str) -> NotFound:
    return NotFound(f"There is no hand {name!r}; `GET /v1/hands` lists them.")
