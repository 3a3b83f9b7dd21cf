"""The parts of a running service and how they start and stop together.

One machine does everything in one process. Of several machines replicas answer requests, and agents run jobs; tables
and files are then shared.
"""

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Literal

from fingersplit_service.blobs import BlobStore
from fingersplit_service.database.cluster_queue import ClusterQueue
from fingersplit_service.database.connection import Database, database_url
from fingersplit_service.database.datasets import DatasetStore
from fingersplit_service.database.follow_ups import FollowUpStore
from fingersplit_service.database.hands import HandStore
from fingersplit_service.database.jobs import JobStore
from fingersplit_service.database.keys import KeyStore
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.outcomes import OutcomeStore
from fingersplit_service.database.queue import JobQueue
from fingersplit_service.database.usage import Limits, UsageStore
from fingersplit_service.jobs.agent import Agent
from fingersplit_service.jobs.cluster_notifier import ClusterNotifier
from fingersplit_service.jobs.dataset_rounds import DatasetRounds
from fingersplit_service.jobs.dataset_service import DatasetService
from fingersplit_service.jobs.dispatcher import Dispatcher
from fingersplit_service.jobs.follow_ups import FollowUps
from fingersplit_service.jobs.hand_catalog import HandCatalog
from fingersplit_service.jobs.hand_service import HandService
from fingersplit_service.jobs.job_runner import JobRunner, OtherMachines
from fingersplit_service.jobs.job_service import JobService
from fingersplit_service.jobs.notifier import Notifier
from fingersplit_service.jobs.object_service import ObjectService
from fingersplit_service.jobs.outcome_service import OutcomeService
from fingersplit_service.jobs.parallel_grasp_service import ParallelGraspService
from fingersplit_service.jobs.result_service import ResultService
from fingersplit_service.jobs.usage import Meter, UsageService
from fingersplit_service.jobs.worker_functions import WorkerFunctions
from fingersplit_service.jobs.worker_pool import WorkerPool
from fingersplit_service.operations.exposure import refuse_exposure
from fingersplit_service.operations.health import HealthService
from fingersplit_service.operations.retention import Retention
from fingersplit_service.security.access import Access
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage
from fingersplit_service.telemetry.metrics import Metrics
from fingersplit_service.telemetry.tracing import tracing

__all__ = ["Role", "Runtime", "running"]

Role = Literal["serve", "work"]
"""Of several machines: answers requests, or runs jobs."""
_CONNECTIONS = 4  # transactions of either kind that a process of several machines may run at once
_PATIENCE = {"serve": 5.0, "work": 45.0}  # with an object store that does not answer [s]


@dataclass(frozen=True)
class Runtime:
    """What the endpoints work with; `dependencies` gives each of them what it asks for."""

    settings: ServiceSettings
    jobs: JobService
    objects: ObjectService
    parallel_grasps: ParallelGraspService
    results: ResultService
    outcomes: OutcomeService
    datasets: DatasetService
    hands: HandService
    catalog: HandCatalog
    health: HealthService
    access: Access
    storage: Storage
    notifier: Notifier
    usage: UsageService
    runner: JobRunner

    def wind_down(self) -> None:
        """Begin no more jobs, and end all waits for jobs; what runs may end."""
        self.runner.stop_claiming()
        self.notifier.close()


@asynccontextmanager
async def running(
    settings: ServiceSettings, functions: WorkerFunctions, metrics: Metrics, role: Role = "serve"
) -> AsyncIterator[Runtime]:
    """Hold the data directory, start the workers, queue old jobs again; undo it in the other order.

    Raises:
        DataDirectoryInUse: Another service works on the data directory.
        DatabaseInUse: Another service works on the database.
        StorageUnavailable: The database cannot be opened.
        SchemaTooNew: The database is that of a newer version.
        Exposed: The service would be open to everybody, and there is no key.
    """
    shared = BlobStore(settings.storage_url, _PATIENCE[role]) if settings.storage_url else None
    storage = Storage(settings.data_dir.absolute(), settings.cache_bytes, shared)
    async with AsyncExitStack() as stack:
        stack.enter_context(storage.lock())
        url = database_url(settings.database_url, storage.database)
        database = Database(url, _CONNECTIONS if settings.cluster else 1)
        stack.callback(database.close)
        database.lock(shared=settings.cluster)
        keys = KeyStore(database)
        await refuse_exposure(settings, keys)
        stack.enter_context(tracing(settings.otlp_endpoint))
        meter = Meter()
        usage = UsageService(UsageStore(database), meter, Limits.of(settings))
        usage.start()
        stack.push_async_callback(usage.stop)
        pool = _pool(settings, functions, metrics, meter)
        stack.push_async_callback(pool.stop)
        object_store, job_store, hand_store = ObjectStore(database), JobStore(database), HandStore(database)
        parts = _Parts(settings, database, job_store, storage, pool, metrics, functions, meter)
        if not settings.cluster:
            notifier, runner, leads = *await parts.start_alone(stack), lambda: True
        elif role == "serve":
            notifier, runner, leads = *await parts.start_replica(stack), lambda: False
        else:
            notifier, runner, leads = await parts.start_agent(stack)
        stack.callback(notifier.close)
        retention = Retention(job_store, object_store, hand_store, storage, settings, leads)
        stack.push_async_callback(_end, asyncio.create_task(retention.run()))
        catalog = HandCatalog(pool, hand_store)
        jobs = JobService(job_store, object_store, catalog, runner, notifier, storage, metrics, settings)
        objects = ObjectService(object_store, storage, pool, functions, settings, usage)
        results = ResultService(jobs, storage, pool, functions, settings)
        dataset_store = DatasetStore(database)
        rounds = DatasetRounds(dataset_store, job_store, jobs, settings.keep_jobs_s)
        if role == "serve":
            stack.push_async_callback(_end, asyncio.create_task(rounds.run()))
        yield Runtime(
            settings=settings,
            jobs=jobs,
            objects=objects,
            parallel_grasps=ParallelGraspService(
                objects, object_store, storage, pool, functions, catalog, settings, usage
            ),
            results=results,
            outcomes=OutcomeService(OutcomeStore(database), jobs, results),
            datasets=DatasetService(dataset_store, jobs, object_store, results, rounds.wake),
            hands=HandService(hand_store, catalog, storage, pool, functions, settings, usage),
            catalog=catalog,
            health=HealthService(job_store, pool, storage, notifier, metrics),
            access=Access(keys),
            storage=storage,
            notifier=notifier,
            usage=usage,
            runner=runner,
        )


def _pool(settings: ServiceSettings, functions: WorkerFunctions, metrics: Metrics, meter: Meter) -> WorkerPool:
    return WorkerPool(
        settings.workers,
        spares=settings.spare_workers,
        memory_bytes=settings.worker_memory_bytes,
        recycle_bytes=settings.worker_recycle_bytes,
        warm=functions.warm,
        warm_deadline_s=settings.warm_deadline_s,
        silence_s=settings.worker_silence_s,
        observe_wait=metrics.answers_waited.observe,
        measure=meter.measure,
    )


@dataclass(frozen=True)
class _Parts:
    """What runs jobs or has them run, in the three ways there are; each is stopped by the stack."""

    settings: ServiceSettings
    database: Database
    jobs: JobStore
    storage: Storage
    pool: WorkerPool
    metrics: Metrics
    functions: WorkerFunctions
    meter: Meter

    async def start_alone(self, stack: AsyncExitStack) -> tuple[Notifier, JobRunner]:
        """Everything in this process."""
        notifier, queue = Notifier(self.settings.max_waiting), JobQueue(self.database)
        dispatcher, _ = await self._run_jobs(stack, queue, notifier, FollowUpStore(self.database))
        return notifier, dispatcher

    async def start_replica(self, stack: AsyncExitStack) -> tuple[Notifier, JobRunner]:
        """Jobs run elsewhere; the workers here read uploads and draw."""
        notifier = await self._listen(stack, runs_jobs=False)
        stack.push_async_callback(self.pool.stop_refilling)
        self.pool.start()
        return notifier, OtherMachines(notifier)

    async def start_agent(self, stack: AsyncExitStack) -> tuple[Notifier, JobRunner, Callable[[], bool]]:
        """Jobs of all replicas run here and on other agents; also whether this one does what one does for all."""
        notifier = await self._listen(stack, runs_jobs=True)
        queue = ClusterQueue(self.database, f"{socket.gethostname()} {os.getpid()}", self.settings.workers)
        verified = FollowUpStore(self.database, lambda: queue.agent)
        dispatcher, follow_ups = await self._run_jobs(stack, queue, notifier, verified)
        agent = Agent(queue, dispatcher, follow_ups, notifier, self.pool, self.settings.agent_silence_s)
        agent.start()
        stack.push_async_callback(agent.stop)
        # Said again, to come before the agent leaves: its jobs end or go back to the queue while it is known.
        stack.push_async_callback(dispatcher.stop)
        return notifier, dispatcher, lambda: agent.leads

    async def _listen(self, stack: AsyncExitStack, *, runs_jobs: bool) -> ClusterNotifier:
        settings = self.settings
        url = database_url(settings.database_session_url or settings.database_url, self.storage.database)
        notifier = ClusterNotifier(self.jobs, url, settings.max_waiting, runs_jobs=runs_jobs)
        notifier.start()
        stack.push_async_callback(notifier.stop)
        return notifier

    async def _run_jobs(
        self, stack: AsyncExitStack, queue: JobQueue, notifier: Notifier, verified: FollowUpStore
    ) -> tuple[Dispatcher, FollowUps]:
        follow_ups = FollowUps(verified, self.storage, self.pool, notifier, self.functions, self.settings)
        dispatcher = Dispatcher(
            queue,
            self.storage,
            self.pool,
            notifier,
            self.metrics,
            self.settings,
            self.functions,
            follow_ups,
            self.meter,
        )
        stack.push_async_callback(dispatcher.stop)
        stack.push_async_callback(self.pool.stop_refilling)
        self.pool.start()
        await dispatcher.start()
        await follow_ups.start()
        stack.push_async_callback(follow_ups.stop)
        return dispatcher, follow_ups


async def _end(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
