"""Results as the endpoints see them: grasps, views of them, and files for other tools."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from fingersplit.errors import FormatError, HandError, ResultError, UnknownHandError
from fingersplit_client.schemas import Grasp, JobCreate
from fingersplit_service.jobs.dataset_shards import SHARD, ShardTask
from fingersplit_service.jobs.errors import InvalidField, NotFinished, NotFound, ResourceGone
from fingersplit_service.jobs.job_service import JobService, JobView
from fingersplit_service.jobs.outcome import read_grasps
from fingersplit_service.jobs.planning import STARTS, PlanTask
from fingersplit_service.jobs.rendering import ExportedFile, RenderTask, ViewName, best_rank
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["ResultService"]


class ResultService:
    """What can be done with the results of jobs; every method acts for one owner.

    Views are made when they are first asked for and then kept: they are off the way of a job's answer, and only runs
    that somebody looks at take space. Small pictures for lists alone are made in advance, by a spare worker.

    Args:
        jobs: The jobs.
        storage: Where views are kept.
        pool: The workers that make them.
        functions: What workers run.
        settings: Deadlines.
    """

    def __init__(
        self,
        jobs: JobService,
        storage: Storage,
        pool: WorkerPool,
        functions: WorkerFunctions,
        settings: ServiceSettings,
    ) -> None:
        self._jobs, self._storage, self._pool = jobs, storage, pool
        self._functions, self._settings = functions, settings

    async def grasps(self, owner: str, job_id: str) -> list[Grasp]:
        """A job's grasps, best first; none for a job that failed or was cancelled.

        Raises:
            NotFound: The owner has no such job.
            NotFinished: It has not ended.
            ResourceGone: Its result is of another version.
        """
        return _grasps(await self._ended(owner, job_id))

    async def grasp(self, owner: str, job_id: str, rank: int) -> Grasp:
        """One grasp. Raises as `grasps`, and NotFound for a rank that there is not."""
        return _of_rank(job_id, await self.grasps(owner, job_id), rank)

    async def view(self, owner: str, job_id: str, rank: int | None, name: ViewName) -> Path:
        """The file of a view, made by a worker unless it is there.

        Args:
            owner: Whose job it is.
            job_id: The job.
            rank: Rank of the grasp; None for the one that stands for the run.
            name: The view.

        Raises:
            NotFound: No such job, or no such grasp.
            NotFinished: The job has not ended.
            ResourceGone: It cannot be made any more.
        """
        job = await self._ended(owner, job_id)
        grasps = _grasps(job)
        chosen = best_rank(grasps) if rank is None else _of_rank(job_id, grasps, rank).rank
        if chosen is None or job.result is None:
            raise NotFound(f"Job {job_id} found no grasp to look at.")
        if name == "motion.json.gz" and _of_rank(job_id, grasps, chosen).verification is None:
            raise NotFound(f"Grasp {chosen} of job {job_id} was not simulated.")
        path = self._storage.view(job_id, chosen, name)
        request = JobCreate.model_validate_json(job.row.request)
        task = RenderTask(name, job_id, chosen, job.row.object_name, request, job.result)
        return await self._made(owner, job, path, self._functions.render, task)

    async def starts(self, owner: str, job_id: str) -> Path:
        """The file that says where each start of a job ended and why, made by a worker unless it is there.

        Raises:
            NotFound: No such job, or it has no result.
            NotFinished: The job has not ended.
            ResourceGone: It cannot be made any more.
        """
        job = await self._ended(owner, job_id)
        if job.result is None:
            raise NotFound(f"Job {job_id} has no result.")
        request = JobCreate.model_validate_json(job.row.request)
        deadline = self._settings.plan_deadline_s
        task = PlanTask(job_id, job.row.object_name, request, deadline)
        path = self._storage.view(job_id, 0, STARTS)
        return await self._made(owner, job, path, self._functions.draw_starts, task, deadline)

    async def shard(self, owner: str, task: ShardTask) -> Path:
        """The file of a data set's round, made by a worker unless it is there.

        Raises:
            NotFound: No such job, or it has no result.
            NotFinished: The job has not ended.
            ResourceGone: It cannot be made any more.
        """
        job = await self._ended(owner, task.job_id)
        if job.result is None:
            raise NotFound(f"Job {task.job_id} has no result.")
        path = self._storage.view(task.job_id, 0, SHARD)
        return await self._made(owner, job, path, self._functions.write_shard, replace(task, result=job.result))

    async def _made(
        self,
        owner: str,
        job: JobView,
        path: Path,
        function: Callable[[Storage, Any], None],
        task: RenderTask | PlanTask | ShardTask,
        deadline_s: float | None = None,
    ) -> Path:
        """A file of a job, made by a worker unless it is there."""
        with suppress(FileNotFoundError):
            return await asyncio.to_thread(self._storage.local, path)
        if not await asyncio.to_thread(self._storage.exists, self._storage.shape(job.row.object_id)):
            raise ResourceGone("It cannot be made any more: its object was deleted.")
        self._storage.job_folder(job.row.id).mkdir(parents=True, exist_ok=True)
        deadline = deadline_s or self._settings.picture_deadline_s
        arguments = function, self._storage, task
        try:
            await self._pool.answer(owner, *arguments, deadline_s=deadline, object_id=job.row.object_id)
        except (ResultError, HandError) as error:
            raise ResourceGone(f"It cannot be made any more: {error}") from error
        except UnknownHandError:
            raise ResourceGone("It cannot be made any more: its hand was deleted.") from None
        except FileNotFoundError:
            raise ResourceGone("It cannot be made any more: the job was deleted.") from None
        return path

    async def export(self, owner: str, job_id: str, format_name: str, rank: int | None) -> ExportedFile:
        """The feasible grasps, best first, or one grasp, as a file of another tool.

        Raises:
            NotFound: No such job, or it has no result.
            NotFinished: The job has not ended.
            InvalidField: The result has no grasp to write.
            ResourceGone: The hand was deleted.
        """
        job = await self._ended(owner, job_id)
        if job.result is None:
            raise NotFound(f"Job {job_id} has no result.")
        arguments = self._functions.convert, self._storage, job.result, format_name, rank
        try:
            return await self._pool.answer(owner, *arguments, deadline_s=self._settings.picture_deadline_s)
        except (FormatError, ResultError) as error:
            raise InvalidField("/format_name", str(error)) from error
        except UnknownHandError:
            raise ResourceGone("The hand of the result was deleted; formats need its links and joints.") from None

    async def _ended(self, owner: str, job_id: str) -> JobView:
        job = await self._jobs.get(owner, job_id)
        if not job.row.ended:
            raise NotFinished(f"Job {job_id} is {job.row.state}; its result comes when it has ended.")
        return job


def _grasps(job: JobView) -> list[Grasp]:
    try:
        return read_grasps(job.result)
    except ResultError as error:
        raise ResourceGone(str(error)) from error


def _of_rank(job_id: str, grasps: list[Grasp], rank: int) -> Grasp:
    for grasp in grasps:
        if grasp.rank == rank:
            return grasp
    raise NotFound(f"Job {job_id} has {len(grasps)} grasps, and no rank {rank}.")
