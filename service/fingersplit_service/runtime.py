"""The parts of a running service and how they start and stop together."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request
from pydantic import TypeAdapter

from fingersplit_client.schemas import HandInfo
from fingersplit_service.jobs.dispatcher import Dispatcher
from fingersplit_service.jobs.engine import Engine
from fingersplit_service.jobs.store import Store
from fingersplit_service.jobs.tasks import Tasks
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.storage import Storage

__all__ = ["Runtime", "RuntimeDependency", "running"]

_HANDS = TypeAdapter(list[HandInfo])


@dataclass(frozen=True)
class Runtime:
    """What the endpoints work with."""

    settings: ServiceSettings
    tasks: Tasks
    storage: Storage
    store: Store
    engine: Engine
    dispatcher: Dispatcher

    def hands(self) -> list[HandInfo]:
        """The hands that can be planned for, as the workers know them.

        Raises:
            ProblemError: No worker is warm yet.
        """
        if self.engine.warmth is None:
            raise ProblemError(ProblemKind.NOT_READY, "The workers are still starting; try again in a second.")
        return _HANDS.validate_python(self.engine.warmth)


@asynccontextmanager
async def running(settings: ServiceSettings, tasks: Tasks) -> AsyncIterator[Runtime]:
    """Hold the data directory, start the workers, take up old jobs; undo it in the other order.

    Raises:
        DataDirectoryInUse: Another service works on the data directory.
    """
    storage = Storage(settings.data_dir.absolute())
    with storage.lock():
        store = Store(storage.database)
        engine = Engine(settings.workers, settings.worker_memory_bytes, tasks.warm, settings.warm_deadline_s)
        dispatcher = Dispatcher(
            store,
            storage,
            engine,
            runners=settings.workers,
            plan=tasks.plan,
            deadline_s=settings.plan_deadline_s,
        )
        try:
            engine.start()
            await dispatcher.start()
            yield Runtime(settings, tasks, storage, store, engine, dispatcher)
        finally:
            await engine.stop_refilling()
            await dispatcher.stop()
            await engine.stop()
            store.close()


def _runtime(request: Request) -> Runtime:
    runtime: Runtime = request.app.state.runtime
    return runtime


RuntimeDependency = Annotated[Runtime, Depends(_runtime)]
"""The runtime, as a parameter of an endpoint."""
