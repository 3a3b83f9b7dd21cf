"""Fills data sets: queues the rounds of their objects as jobs, some at a time, until each has what is wanted.

Everything follows from the tables, and a round's job has an id that follows from data set, object and round. So nothing
is lost or planned twice when a service dies, and replicas may fill one data set together.
"""

import asyncio
import hashlib
import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

from fingersplit.dataset.request import BARREN, MAX_ROUND
from fingersplit.errors import ResultError
from fingersplit_client.schemas import DatasetCreate, JobCreate
from fingersplit_service.blobs import BlobsUnavailable
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.database.datasets import DatasetRow, DatasetStore, RoundRow
from fingersplit_service.database.jobs import JobStore, QueueFull
from fingersplit_service.database.usage import LimitReached
from fingersplit_service.jobs.errors import InvalidField, WorkersNotReady
from fingersplit_service.jobs.job_service import JobService
from fingersplit_service.jobs.outcome import read_grasps

__all__ = ["DatasetRounds", "missing_of", "refusal_of", "round_request"]

_log = logging.getLogger(__name__)
_AT_ONCE = 16  # rounds of one data set that are queued or run
_BUSY = 0.5  # between two looks while something is being filled [s]
_IDLE = 10.0  # else; replicas may have been given some [s]
_HOUR = 3_600.0


def round_request(asked: DatasetCreate, object_id: str, number: int, missing: int) -> JobCreate:
    """The job of a round; equal rounds are equal jobs."""
    job = asked.job
    chosen = {
        "object_id": object_id,
        "seed": job.seed + number,
        "top_k": min(job.starts, MAX_ROUND),
        "verified": missing if asked.verified else 0,
        "verify_first": False,
        "recording": False,
    }
    return JobCreate.model_validate(job.model_dump() | chosen)


def missing_of(asked: DatasetCreate, rounds: Sequence[RoundRow]) -> int:
    """Grasps of an object that are still wanted."""
    return max(0, asked.per_object - sum(one.selected for one in rounds))


def refusal_of(asked: DatasetCreate, rounds: Sequence[RoundRow]) -> tuple[str, str] | None:
    """Code and sentence where an object is given up, as one machine would; None while there is hope."""
    for one in rounds:
        if one.state == "failed":
            return one.error_code or "internal", one.error_detail or "The job of a round failed."
    if not missing_of(asked, rounds) or any(one.state == "open" for one in rounds):
        return None
    barren = len(rounds) >= BARREN and not any(one.selected for one in rounds[-BARREN:])
    if barren or len(rounds) >= asked.max_rounds:
        have = asked.per_object - missing_of(asked, rounds)
        return "too_few_grasps", f"{have} of {asked.per_object} grasps after {len(rounds)} rounds."
    return None


class DatasetRounds:
    """The loop that fills data sets.

    Args:
        store: The data sets.
        job_store: The jobs of all owners.
        jobs: Who queues jobs.
        keep_s: How long data sets are kept after their end, as jobs are [s].
    """

    def __init__(self, store: DatasetStore, job_store: JobStore, jobs: JobService, keep_s: float) -> None:
        self._store, self._job_store, self._jobs, self._keep_s = store, job_store, jobs, keep_s
        self._woken = asyncio.Event()
        self._swept = 0.0

    def wake(self) -> None:
        """Say that there is one to fill."""
        self._woken.set()

    async def run(self) -> NoReturn:
        """Fill what is to be filled, again and again."""
        while True:
            busy = False
            try:
                for row in await self._store.running():
                    busy = True
                    await self._step(row)
                if time.time() > self._swept + _HOUR:
                    self._swept = time.time()
                    await self._store.delete_finished_before(self._swept - self._keep_s)
            except (StorageUnavailable, BlobsUnavailable, WorkersNotReady):
                _log.warning("Data sets cannot be filled now.", exc_info=True)
            except Exception:
                _log.exception("A data set could not be filled.")
            self._woken.clear()
            try:
                async with asyncio.timeout(_BUSY if busy else _IDLE):
                    await self._woken.wait()
            except TimeoutError:
                continue

    async def _step(self, row: DatasetRow) -> None:
        """Note which rounds have ended, and begin the next ones."""
        asked = DatasetCreate.model_validate_json(row.request)
        rounds: list[list[RoundRow]] = [[] for _ in asked.objects]
        for one in await self._store.rounds(row.id):
            rounds[one.object_index].append(one)
        await self._note_ended(row, asked, rounds)
        running = sum(one.state == "open" for begun in rounds for one in begun)
        waits = False
        for index, begun in enumerate(rounds):
            missing = missing_of(asked, begun)
            if not missing or refusal_of(asked, begun) is not None:
                continue
            waits = True
            if running < _AT_ONCE and not any(one.state == "open" for one in begun):
                if not await self._begin(row, asked, index, len(begun), min(missing, MAX_ROUND)):
                    return
                running += 1
        if not waits:
            await self._store.finish(row.id, "complete")

    async def _note_ended(self, row: DatasetRow, asked: DatasetCreate, rounds: list[list[RoundRow]]) -> None:
        begun = {one.job_id: one for of_object in rounds for one in of_object if one.state == "open"}
        jobs = {job.id: job for job in await self._job_store.states(list(begun))}
        changed = list[RoundRow]()
        for job_id, one in begun.items():
            job = jobs.get(job_id)
            if job is None:
                changed.append(_failed(one, "deleted", "The job of a round was deleted."))
            elif job.state == "succeeded":
                found = await self._job_store.get(row.owner, job_id)
                document = None if found is None else found[1]
                if document is not None:
                    changed.append(await asyncio.to_thread(_planned, one, asked.verified, document))
            elif job.ended:
                fault = (job.error.code, job.error.detail) if job.error else ("cancelled", "Its job was cancelled.")
                changed.append(_failed(one, *fault))
        await self._store.end(changed)
        for one in changed:
            rounds[one.object_index][one.round] = one

    async def _begin(self, row: DatasetRow, asked: DatasetCreate, index: int, number: int, missing: int) -> bool:
        """Queue a round; False where the owner may queue no more now."""
        name = f"dataset {row.id} {index} {number}"
        job_id = hashlib.sha256(name.encode()).hexdigest()[:32]
        began = RoundRow(row.id, index, number, job_id, missing)
        try:
            request = round_request(asked, asked.objects[index], number, missing)
            await self._jobs.submit_as(row.owner, request, job_id, batch_id=row.id, idempotency_key=name)
        except (QueueFull, LimitReached):
            return False
        except InvalidField as error:  # its object or hand was deleted
            await self._store.begin(_failed(began, "refused", error.detail))
            return True
        await self._store.begin(began)
        return True


def _failed(one: RoundRow, code: str, detail: str) -> RoundRow:
    return replace(one, state="failed", error_code=code, error_detail=detail)


def _planned(one: RoundRow, verified: bool, document: str) -> RoundRow:
    """A round with what its result, JSON, has; grasps beyond those that were missing do not count."""
    try:
        grasps = read_grasps(document)
    except ResultError as error:
        return _failed(one, "refused", str(error))
    feasible = sum(grasp.feasible for grasp in grasps)
    held = sum(grasp.verification is not None and grasp.verification.passed for grasp in grasps)
    selected = min(held if verified else feasible, one.missing)
    return replace(one, state="planned", grasps=len(grasps), feasible=feasible, held=held, selected=selected)
