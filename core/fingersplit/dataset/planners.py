"""Who plans the rounds of an object: processes of this machine, or a service."""

import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from fingersplit.dataset.filling import PlanRound, fill_object
from fingersplit.dataset.request import DatasetObject, DatasetRequest
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.objects.options import ObjectOptions
from fingersplit.result.plan import PlanResult

__all__ = ["LocalPlanner", "ObjectTask", "Planner", "ServicePlanner", "cores"]

PlanRemotely = Callable[[Path, dict[str, Any]], dict[str, Any]]
"""From a file and what is said of object and job to a result document; ``{"error": ..., "code": ...}`` if
refused. Where it has a method ``close``, that is called in the end."""


@dataclass(frozen=True)
class ObjectTask:
    """One object to fill: the data set's folder and order, the object and its file."""

    folder: Path
    request: DatasetRequest
    item: DatasetObject
    file: Path


class Planner(Protocol):
    """What works on objects side by side."""

    slots: int
    """How many objects at a time."""

    def submit(self, task: ObjectTask, active: int) -> "Future[None]":
        """Begin with an object; ``active`` objects are left, this one among them."""

    def death_of(self, future: "Future[None]") -> str | None:
        """What killed the worker of an ended task; None where it lives."""

    def close(self) -> None:
        """End all work."""


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class LocalPlanner:
    """Processes of this machine, one a slot, so that an object that kills its worker takes no other with it.

    Args:
        workers: How many; None for one a core. Cores that are left over search and verify one object together.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.slots = workers or cores()
        self._idle = [self._new_pool() for _ in range(self.slots)]
        self._pools = dict[Future[None], ProcessPoolExecutor]()

    def submit(self, task: ObjectTask, active: int) -> "Future[None]":
        """Begin with an object in a free process."""
        pool = self._idle.pop()
        future = pool.submit(_fill_here, task, max(1, cores() // min(active, self.slots)))
        self._pools[future] = pool
        return future

    def death_of(self, future: "Future[None]") -> str | None:
        """What killed the worker of an ended task; its place is taken by a new one."""
        pool = self._pools.pop(future)
        if not isinstance(future.exception(), BrokenProcessPool):
            self._idle.append(pool)
            return None
        pool.shutdown(wait=False)
        self._idle.append(self._new_pool())
        return "The process that planned for this object was killed, twice; it may need more memory than there is."

    def close(self) -> None:
        """End the processes."""
        for pool in (*self._idle, *self._pools.values()):
            for process in list((pool._processes or {}).values()):
                process.terminate()
            pool.shutdown(wait=True, cancel_futures=True)

    @staticmethod
    def _new_pool() -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=_end_with_parent)


class ServicePlanner:
    """A service that is given jobs, some at a time.

    Args:
        plan: Plans one round there.
        at_once: How many objects at a time.
    """

    def __init__(self, plan: PlanRemotely, at_once: int = 16) -> None:
        self.slots = at_once
        self._plan = plan
        self._pool = ThreadPoolExecutor(at_once)

    def submit(self, task: ObjectTask, active: int) -> "Future[None]":  # noqa: ARG002 -- the service has its workers
        """Begin with an object in a thread of its own."""
        return self._pool.submit(_fill_there, task, self._plan)

    def death_of(self, future: "Future[None]") -> str | None:  # noqa: ARG002
        """None: the service's own workers are its matter."""
        return None

    def close(self) -> None:
        """Wait for the jobs on their way; begin no other."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        getattr(self._plan, "close", lambda: None)()


def _end_with_parent() -> None:
    """Let a worker end when the program that began it is killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _fill_here(task: ObjectTask, threads: int) -> None:
    fill_object(task.folder, task.request, task.item, lambda: _local_rounds(task, threads))


def _local_rounds(task: ObjectTask, threads: int) -> tuple[Hand, PlanRound]:
    """The hand, and what plans a round of an object in this process."""
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.planning.planning import plan
    from fingersplit.scene import Constraints
    from fingersplit.splitting.settings import PlannerSettings
    from fingersplit.verification import verify_ranked

    request = task.request
    hand, options = (
        load_hand(request.hand),
        ObjectOptions(request.density, request.mass, request.friction, request.fairing),
    )
    model = load_object(task.file, unit=request.unit, scale=request.scale, name=task.item.name, options=options)
    settings, constraints = (
        PlannerSettings.from_document(request.planner),
        Constraints.from_document(request.constraints),
    )
    pieces = decompose(model.mesh) if request.verified else None

    def plan_round(number: int, missing: int) -> PlanResult:
        result = plan(
            model,
            hand,
            source=request.source,
            starts=request.starts,
            seed=request.round_seed(number),
            top_k=request.top_k,
            settings=settings,
            constraints=constraints,
            threads=threads,
        )
        if pieces is None:
            return result
        return verify_ranked(
            result,
            model,
            hand,
            pieces,
            verified=missing,
            protocol=request.protocol,
            controller=request.controller,
            friction=request.simulated_friction,
            threads=threads,
        )

    return hand, plan_round


def _fill_there(task: ObjectTask, plan: PlanRemotely) -> None:
    fill_object(task.folder, task.request, task.item, lambda: _remote_rounds(task, plan))


def _remote_rounds(task: ObjectTask, plan: PlanRemotely) -> tuple[Hand, PlanRound]:
    """The hand, and what has a round of an object planned by a service."""
    from fingersplit.dataset.filling import ObjectRefusedError

    request = task.request
    told: dict[str, Any] = {
        **{
            name: getattr(request, name) for name in ("hand", "unit", "scale", "density", "mass", "friction", "fairing")
        },
        **{name: getattr(request, name) for name in ("starts", "top_k", "source", "planner", "protocol", "controller")},
        **request.constraints,
        "name": task.item.name,
        "simulated_friction": request.simulated_friction,
        "recording": False,
        "verify_first": False,
    }

    def plan_round(number: int, missing: int) -> PlanResult:
        verified = missing if request.verified else 0
        document = plan(task.file, told | {"seed": request.round_seed(number), "verified": verified})
        if "error" in document:
            raise ObjectRefusedError(document["code"], document["error"])
        return PlanResult.from_dict(document)

    return load_hand(request.hand), plan_round
