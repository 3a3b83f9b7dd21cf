"""The parts of a running service and how they start and stop together."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated
from uuid import uuid4

from fastapi import Depends, Request
from pydantic import TypeAdapter

from fingersplit_client.schemas import HandInfo
from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.queue import Queue
from fingersplit_service.jobs.dispatcher import Dispatcher
from fingersplit_service.jobs.engine import Engine
from fingersplit_service.jobs.tasks import Tasks
from fingersplit_service.jobs.watch import Watch
from fingersplit_service.operations.metrics import Metrics
from fingersplit_service.operations.retention import Retention
from fingersplit_service.operations.tracing import tracing
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.security.access import Access
from fingersplit_service.security.exposure import refuse_exposure
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["Runtime", "RuntimeDependency", "running"]

_HANDS = TypeAdapter(list[HandInfo])


@dataclass
class Runtime:
    """What the endpoints work with."""

    settings: ServiceSettings
    tasks: Tasks
    metrics: Metrics
    storage: Storage
    objects: ObjectStore
    jobs: JobStore
    access: Access
    watch: Watch
    engine: Engine
    dispatcher: Dispatcher

    def hands(self) -> list[HandInfo]:
        """The hands that can be planned for, as the workers know them.

        Raises:
            ProblemError: No worker is warm yet.
        """
        if self.engine.warmth is None:
            raise ProblemError(ProblemKind.NOT_READY, "The workers are still starting; try again in a second.")
        return self._hands

    @cached_property
    def _hands(self) -> list[HandInfo]:
        return _HANDS.validate_python(self.engine.warmth.hands if self.engine.warmth else [])

    async def remove_job_files(self, job_id: str) -> None:
        """Delete what is kept of a job beside its row, once nothing more is written."""
        await self.dispatcher.released(job_id)
        await asyncio.to_thread(self.storage.remove_job, job_id)


@asynccontextmanager
async def running(settings: ServiceSettings, tasks: Tasks, metrics: Metrics) -> AsyncIterator[Runtime]:
    """Hold the data directory, start the workers, take up old jobs; undo it in the other order.

    Raises:
        DataDirectoryInUse: Another service works on the data directory.
        StorageUnavailable: The database cannot be opened.
        Exposed: Strangers could reach the service, and there is no key.
    """
    storage = Storage(settings.data_dir.absolute(), settings.cache_bytes)
    async with AsyncExitStack() as stack:
        stack.enter_context(storage.lock())
        database = Database(database_url(settings.database_url, storage.database))
        stack.callback(database.close)
        keys = KeyStore(database)
        await refuse_exposure(settings, keys)
        stack.enter_context(tracing(settings.otlp_endpoint))
        engine = Engine(
            settings.workers,
            spares=settings.spare_workers,
            memory_bytes=settings.worker_memory_bytes,
            recycle_bytes=settings.worker_recycle_bytes,
            warm=tasks.warm,
            warm_deadline_s=settings.warm_deadline_s,
        )
        stack.push_async_callback(engine.stop)
        watch, objects, jobs = Watch(), ObjectStore(database), JobStore(database)
        queue = Queue(database, uuid4().hex, settings.lease_s)
        dispatcher = Dispatcher(queue, storage, engine, watch, metrics, settings, tasks)
        stack.push_async_callback(dispatcher.stop)
        stack.push_async_callback(engine.stop_refilling)
        engine.start()
        await dispatcher.start()
        stack.callback(watch.close)
        sweeping = asyncio.create_task(Retention(jobs, objects, storage, settings).run())
        stack.push_async_callback(_end, sweeping)
        yield Runtime(settings, tasks, metrics, storage, objects, jobs, Access(keys), watch, engine, dispatcher)


async def _end(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


async def _runtime(request: Request) -> Runtime:  # without ``async`` each request would wait for a thread
    runtime: Runtime = request.app.state.runtime
    return runtime


RuntimeDependency = Annotated[Runtime, Depends(_runtime)]
"""The runtime, as a parameter of an endpoint."""
