"""From what a request asks for to a job that can be queued."""

import hashlib
import math
from collections.abc import Sequence
from typing import Annotated
from uuid import uuid4

from fastapi import Header
from pydantic import TypeAdapter

from fingersplit.contacts.friction import without_friction
from fingersplit.errors import ParallelGraspError, SettingsError
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.splitting.settings import PlannerSettings
from fingersplit_client.schemas import JobCreate
from fingersplit_client.schemas import ParallelGrasp as ParallelGraspDocument
from fingersplit_service.database.jobs import IdempotencyConflict, QueueFull, UnknownObject
from fingersplit_service.database.rows import JobRow, NewJob
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime
from fingersplit_service.security.access import Principal

__all__ = ["IdempotencyKey", "Prefer", "accept", "check_grasps", "order", "wait_seconds"]

IdempotencyKey = Annotated[
    str | None,
    Header(
        description="Repeating a request with the same key returns the first one's job.",
        min_length=1,
        max_length=255,
        pattern=r"^[\x21-\x7e]+$",
    ),
]
Prefer = Annotated[
    str | None,
    Header(description="`wait=<seconds>`: answer when the job ends (200), or then (202).", max_length=200),
]
_GRASPS = TypeAdapter(list[ParallelGraspDocument])


def wait_seconds(runtime: Runtime, prefer: str | None) -> float:
    """How long the answer may wait for the job [s]; a preference that is not understood is ignored (RFC 7240)."""
    for part in (prefer or "").split(","):
        name, _, value = part.partition("=")
        if name.strip().lower() == "wait":
            try:
                seconds = float(value.strip().strip('"'))
            except ValueError:
                return 0.0
            return min(max(seconds, 0.0), runtime.settings.max_wait_s) if math.isfinite(seconds) else 0.0
    return 0.0


async def order(runtime: Runtime, principal: Principal, asked: JobCreate, prefix: str = "") -> NewJob:
    """Refuse what the planner would refuse, while there is somebody to tell; the job, ready to be queued.

    Args:
        runtime: The service.
        principal: Who asks.
        asked: What for.
        prefix: Where it stands in the request, as a JSON pointer.
    """
    hands = [hand.name for hand in runtime.hands()]
    if asked.hand not in hands:
        detail = f"Unknown hand {asked.hand!r}; known hands: {', '.join(hands)}."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"{prefix}/hand", valid=hands)
    try:
        PlannerSettings.from_document(without_friction(asked.planner)[0])
    except SettingsError as error:
        raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field=f"{prefix}/planner") from error
    check_grasps(asked.parallel_grasps or [], prefix)
    digest = hashlib.sha256(asked.model_dump_json().encode()).hexdigest()
    if asked.parallel_grasp_set is not None:
        asked = asked.model_copy(update={"parallel_grasps": await _set_grasps(runtime, principal, asked, prefix)})
    request = asked.model_dump_json()
    return NewJob(uuid4().hex, asked.object_id, asked.hand, asked.priority, asked.deadline_s, request, digest)


def check_grasps(grasps: Sequence[ParallelGraspDocument], prefix: str = "") -> None:
    """Refuse parallel grasps that are none.

    Raises:
        ProblemError: One is not; the field says which.
    """
    for index, grasp in enumerate(grasps):
        try:
            ParallelGrasp.from_document(grasp.model_dump())
        except ParallelGraspError as error:
            field = f"{prefix}/parallel_grasps/{index}"
            raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field=field) from error


async def accept(
    runtime: Runtime,
    principal: Principal,
    new: Sequence[NewJob],
    *,
    batch_id: str | None = None,
    idempotency_key: str | None = None,
) -> tuple[list[JobRow], bool]:
    """Queue jobs; once this has returned they are on disk. Says also whether they are new."""
    try:
        rows, fresh = await runtime.jobs.add(
            principal.owner,
            new,
            longest_queue=runtime.settings.max_queued_jobs,
            batch_id=batch_id,
            idempotency_key=idempotency_key,
        )
    except UnknownObject as error:
        index, object_id = error.args
        field = "/object_id" if batch_id is None else f"/jobs/{index}/object_id"
        detail = f"There is no object {object_id!r}; upload it to /v1/objects first."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=field) from error
    except QueueFull as error:
        limit = runtime.settings.max_queued_jobs
        detail = f"{error.args[0]} jobs are waiting, and at most {limit} may; try again later."
        raise ProblemError(ProblemKind.QUEUE_FULL, detail, retry_after=5, limit=limit) from error
    except IdempotencyConflict as error:
        detail = f"This Idempotency-Key belongs to job {error.args[0]}, which asked for something else."
        raise ProblemError(ProblemKind.KEY_REUSED, detail, field="Idempotency-Key") from error
    runtime.dispatcher.wake()
    return rows, fresh


async def _set_grasps(
    runtime: Runtime, principal: Principal, asked: JobCreate, prefix: str
) -> list[ParallelGraspDocument]:
    field = f"{prefix}/parallel_grasp_set"
    if asked.parallel_grasps is not None:
        detail = "Give parallel_grasps or parallel_grasp_set, not both."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=field)
    assert asked.parallel_grasp_set is not None  # what this is called for
    row = await runtime.objects.grasp_set(principal.owner, asked.object_id, asked.parallel_grasp_set)
    if row is None:
        detail = f"Object {asked.object_id!r} has no set of parallel grasps {asked.parallel_grasp_set!r}."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=field)
    return _GRASPS.validate_json(row["document"])
