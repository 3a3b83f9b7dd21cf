"""From what a client asks for to a job that can be queued."""

import hashlib
import re
from collections.abc import Sequence
from uuid import uuid4

from pydantic import TypeAdapter

from fingersplit.contacts.friction import without_friction
from fingersplit.errors import ParallelGraspError, SettingsError, suggestion
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.splitting.settings import PlannerSettings
from fingersplit_client.schemas import ControllerInfo, JobCreate, ProtocolInfo, SourceInfo
from fingersplit_client.schemas import ParallelGrasp as ParallelGraspDocument
from fingersplit_service.database.objects import ObjectStore
from fingersplit_service.database.rows import NewJob
from fingersplit_service.jobs.constraints import check_constraints
from fingersplit_service.jobs.errors import InvalidField
from fingersplit_service.jobs.hand_catalog import HandCatalog

__all__ = ["check_grasps", "check_hand", "check_source", "new_job"]

_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")
_GRASPS = TypeAdapter(list[ParallelGraspDocument])


async def new_job(objects: ObjectStore, hands: HandCatalog, owner: str, request: JobCreate, prefix: str = "") -> NewJob:
    """Refuse what the planner would refuse, while the client still waits; the job, ready to be queued.

    Args:
        objects: Where sets of parallel grasps are.
        hands: The hands that are known.
        owner: Whose job it will be.
        request: What for.
        prefix: Where it stands in the whole request, as a JSON pointer.

    Raises:
        InvalidField: A field is not valid.
        WorkersNotReady: The hands are not known yet.
    """
    await check_hand(hands, owner, request.hand, prefix)
    check_source(hands, request.source, prefix)
    _check_name("protocol", "verification protocol", request.protocol, hands.protocols(), prefix)
    _check_name("controller", "controller", request.controller, hands.controllers(), prefix)
    if not _ID.fullmatch(request.object_id):
        detail = f"There is no object {request.object_id!r}; upload it to /v1/objects first."
        raise InvalidField(f"{prefix}/object_id", detail)
    try:
        PlannerSettings.from_document(without_friction(request.planner)[0])
    except SettingsError as error:
        raise InvalidField(f"{prefix}/planner", str(error)) from error
    check_grasps(request.parallel_grasps or [], prefix)
    await check_constraints(objects, owner, request, prefix)
    digest = hashlib.sha256(request.model_dump_json().encode()).hexdigest()
    if request.parallel_grasp_set is not None:
        grasps = await _grasps_of_set(objects, owner, request, request.parallel_grasp_set, prefix)
        request = request.model_copy(update={"parallel_grasps": grasps})
    text = request.model_dump_json()
    return NewJob(
        id=uuid4().hex,
        object_id=request.object_id,
        hand=request.hand,
        priority=request.priority,
        deadline_s=request.deadline_s,
        request=text,
        request_hash=digest,
    )


async def check_hand(hands: HandCatalog, owner: str, name: str, prefix: str = "") -> None:
    """Refuse a hand that neither ships nor was uploaded by the owner.

    Raises:
        InvalidField: It is not known; the names of those that ship are in it.
    """
    if not _ID.fullmatch(name) or await hands.find(owner, name) is None:
        known = [hand.name for hand in hands.shipped()]
        detail = f"Unknown hand {name!r}; {suggestion(name, known, 'hands')}"
        raise InvalidField(f"{prefix}/hand", detail, valid=known)


def check_source(hands: HandCatalog, name: str, prefix: str = "") -> None:
    """Refuse a source of parallel grasps that is not known.

    Raises:
        InvalidField: It is not; the valid names are in it.
    """
    _check_name("source", "source of parallel grasps", name, hands.sources(), prefix)


def _check_name(
    field: str, kind: str, name: str, entries: Sequence[SourceInfo | ProtocolInfo | ControllerInfo], prefix: str
) -> None:
    known = [entry.name for entry in entries]
    if name not in known:
        detail = f"Unknown {kind} {name!r}; known: {', '.join(known)}."
        raise InvalidField(f"{prefix}/{field}", detail, valid=known)


def check_grasps(grasps: Sequence[ParallelGraspDocument], prefix: str = "") -> None:
    """Refuse parallel grasps that are none.

    Raises:
        InvalidField: One is not; the field says which.
    """
    for index, grasp in enumerate(grasps):
        try:
            ParallelGrasp.from_document(grasp.model_dump())
        except ParallelGraspError as error:
            raise InvalidField(f"{prefix}/parallel_grasps/{index}", str(error)) from error


async def _grasps_of_set(
    objects: ObjectStore, owner: str, request: JobCreate, set_id: str, prefix: str
) -> list[ParallelGraspDocument]:
    field = f"{prefix}/parallel_grasp_set"
    if request.parallel_grasps is not None:
        raise InvalidField(field, "Give parallel_grasps or parallel_grasp_set, not both.")
    row = await objects.grasp_set(owner, request.object_id, set_id) if _ID.fullmatch(set_id) else None
    if row is None:
        raise InvalidField(field, f"Object {request.object_id!r} has no set of parallel grasps {set_id!r}.")
    return _GRASPS.validate_json(row["document"])
