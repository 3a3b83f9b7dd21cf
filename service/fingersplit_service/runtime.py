"""The parts of a running service and how they start and stop together."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass

from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.follow_ups import FollowUpStore
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.outcomes import OutcomeStore
from fingersplit_service.database.queue import JobQueue
from fingersplit_service.jobs.dispatcher import Dispatcher
from fingersplit_service.jobs.follow_ups import FollowUps
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.job_service import JobService
from fingersplit_service.jobs.notifier import Notifier
from fingersplit_service.jobs.object_service import ObjectService
from fingersplit_service.jobs.outcome_service import OutcomeService
from fingersplit_service.jobs.result_service import ResultService
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.operations.health import HealthService
from fingersplit_service.operations.metrics import Metrics
from fingersplit_service.operations.retention import Retention
from fingersplit_service.operations.tracing import tracing
from fingersplit_service.security.access import Access
from fingersplit_service.security.exposure import refuse_exposure
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["Runtime", "running"]


@dataclass(frozen=True)
class Runtime:
    """What the endpoints work with; `dependencies` gives each of them what it asks for."""

    settings: ServiceSettings
    jobs: JobService
    objects: ObjectService
    results: ResultService
    outcomes: OutcomeService
    hands: HandCatalog
    health: HealthService
    access: Access
    storage: Storage
    notifier: Notifier


@asynccontextmanager
async def running(settings: ServiceSettings, functions: WorkerFunctions, metrics: Metrics) -> AsyncIterator[Runtime]:
    """Hold the data directory, start the workers, queue old jobs again; undo it in the other order.

    Raises:
        DataDirectoryInUse: Another service works on the data directory.
        DatabaseInUse: Another service works on the database.
        StorageUnavailable: The database cannot be opened.
        SchemaTooNew: The database is that of a newer version.
        Exposed: The service would be open to everybody, and there is no key.
    """
    storage = Storage(settings.data_dir.absolute(), settings.cache_bytes)
    async with AsyncExitStack() as stack:
        stack.enter_context(storage.lock())
        database = Database(database_url(settings.database_url, storage.database))
        stack.callback(database.close)
        database.lock()
        keys = KeyStore(database)
        await refuse_exposure(settings, keys)
        stack.enter_context(tracing(settings.otlp_endpoint))
        pool = WorkerPool(
            settings.workers,
            spares=settings.spare_workers,
            memory_bytes=settings.worker_memory_bytes,
            recycle_bytes=settings.worker_recycle_bytes,
            warm=functions.warm,
            warm_deadline_s=settings.warm_deadline_s,
            silence_s=settings.worker_silence_s,
            observe_wait=metrics.answers_waited.observe,
        )
        stack.push_async_callback(pool.stop)
        notifier, object_store, job_store = Notifier(settings.max_waiting), ObjectStore(database), JobStore(database)
        follow_ups = FollowUps(FollowUpStore(database), storage, pool, notifier, functions, settings)
        dispatcher = Dispatcher(JobQueue(database), storage, pool, notifier, metrics, settings, functions, follow_ups)
        stack.push_async_callback(dispatcher.stop)
        stack.push_async_callback(pool.stop_refilling)
        pool.start()
        await dispatcher.start()
        follow_ups.start()
        stack.push_async_callback(follow_ups.stop)
        stack.callback(notifier.close)
        sweeping = asyncio.create_task(Retention(job_store, object_store, storage, settings).run())
        stack.push_async_callback(_end, sweeping)
        hands = HandCatalog(pool)
        jobs = JobService(job_store, object_store, hands, dispatcher, notifier, storage, metrics, settings)
        results = ResultService(jobs, storage, pool, functions, settings)
        yield Runtime(
            settings=settings,
            jobs=jobs,
            objects=ObjectService(object_store, storage, pool, functions, hands, settings),
            results=results,
            outcomes=OutcomeService(OutcomeStore(database), jobs, results),
            hands=hands,
            health=HealthService(job_store, pool, storage, notifier, metrics),
            access=Access(keys),
            storage=storage,
            notifier=notifier,
        )


async def _end(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
