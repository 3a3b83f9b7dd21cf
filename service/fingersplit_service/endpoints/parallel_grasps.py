"""Parallel grasps of an object: have them found, bring your own, list."""

import json
from datetime import UTC, datetime
from typing import Annotated, Any, Literal
from uuid import uuid4

from fastapi import APIRouter, File, Form, Path, Response, UploadFile
from pydantic import TypeAdapter

from fingersplit.errors import FingersplitError, ParallelGraspError
from fingersplit_client.schemas import (
    GraspFormat,
    ImportedGraspSet,
    ParallelGrasp,
    ParallelGraspsCreate,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
)
from fingersplit_service.endpoints.documents import ObjectId, known_object
from fingersplit_service.endpoints.orders import check_grasps
from fingersplit_service.endpoints.uploads import PRINTABLE, read_by_worker, staged, stem
from fingersplit_service.jobs.tasks import GraspFile
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency
from fingersplit_service.security.access import Planner, Principal, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/objects/{object_id}/parallel-grasps"
router = APIRouter(tags=["objects"])
_GRASPS = TypeAdapter(list[ParallelGrasp])
_PROBLEMS = problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST)

SetId = Annotated[str, Path(description="Id of a set.", max_length=64, pattern=r"^[A-Za-z0-9_-]+$")]


@router.post(
    PATH + "/generate",
    status_code=201,
    summary="Have parallel grasps found",
    responses=problem_answers(
        ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST, ProblemKind.NOT_READY, ProblemKind.WORKER_FAILED
    ),
)
async def generate(
    runtime: RuntimeDependency,
    principal: Planner,
    object_id: ObjectId,
    asked: ParallelGraspsGenerate,
    response: Response,
) -> ParallelGraspSet:
    """Find two-contact grasps of an object that fit a hand's opening, and keep them as a set."""
    await known_object(runtime, principal, object_id)
    hands = [hand.name for hand in runtime.hands()]
    if asked.hand not in hands:
        detail = f"Unknown hand {asked.hand!r}; known hands: {', '.join(hands)}."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/hand", valid=hands)
    try:
        found = await runtime.engine.answer(
            runtime.tasks.generate,
            runtime.storage,
            object_id,
            asked.model_dump(),
            deadline_s=runtime.settings.picture_deadline_s,
            object_id=object_id,
        )
    except FingersplitError as error:
        raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field="") from error
    return await _keep(runtime, principal, response, object_id, "generated", asked.name, _GRASPS.validate_python(found))


@router.post(
    PATH,
    status_code=201,
    summary="Bring your own parallel grasps",
    responses=_PROBLEMS,
)
async def import_grasps(
    runtime: RuntimeDependency, principal: Planner, object_id: ObjectId, given: ParallelGraspsCreate, response: Response
) -> ParallelGraspSet:
    """Keep parallel grasps that were found elsewhere as a set."""
    await known_object(runtime, principal, object_id)
    check_grasps(given.parallel_grasps)
    return await _keep(runtime, principal, response, object_id, "imported", given.name, given.parallel_grasps)


@router.post(
    PATH + "/import",
    status_code=201,
    summary="Bring the parallel grasps in a file",
    responses=_PROBLEMS,
)
async def import_file(
    runtime: RuntimeDependency,
    principal: Planner,
    object_id: ObjectId,
    response: Response,
    file: Annotated[
        UploadFile,
        File(
            description="Dex-Net, ACRONYM, GraspGen, Isaac grasp, graspnetAPI or our own JSON, in the object's frame."
        ),
    ],
    file_format: Annotated[
        GraspFormat | None, Form(alias="format", description="Which of these it is; by default its content tells.")
    ] = None,
    name: Annotated[
        str, Form(description="Name for people; by default that of the file.", max_length=200, pattern=PRINTABLE)
    ] = "",
) -> ImportedGraspSet:
    """Keep the parallel grasps in a file as a set; where it holds grippers, their jaws are closed on the object."""
    known = json.loads(await known_object(runtime, principal, object_id))
    try:
        async with staged(runtime, file) as path:
            found, message = await read_by_worker(
                runtime,
                ProblemKind.INVALID_REQUEST,
                runtime.tasks.import_grasps,
                object_id,
                known["name"],
                GraspFile(path, stem(file), file_format),
                object_id=object_id,
            )
    except ParallelGraspError as error:
        raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field="/file") from error
    grasps = _GRASPS.validate_python(found)
    kept = await _keep(runtime, principal, response, object_id, "imported", name or stem(file), grasps)
    return ImportedGraspSet(message=message, **dict(kept))


@router.get(PATH, summary="List the sets", responses=_PROBLEMS)
async def list_sets(runtime: RuntimeDependency, principal: Reader, object_id: ObjectId) -> list[ParallelGraspSetInfo]:
    """The sets of an object without their grasps, newest first; the newest thousand."""
    await known_object(runtime, principal, object_id)
    rows = await runtime.objects.grasp_sets(principal.owner, object_id)
    return [ParallelGraspSetInfo.model_validate(_info(row)) for row in rows]


@router.get(PATH + "/{set_id}", summary="Get a set", responses=_PROBLEMS)
async def get_set(
    runtime: RuntimeDependency, principal: Reader, object_id: ObjectId, set_id: SetId
) -> ParallelGraspSet:
    """One set with its grasps."""
    row = await runtime.objects.grasp_set(principal.owner, object_id, set_id)
    if row is None:
        raise _unknown(object_id, set_id)
    return ParallelGraspSet(parallel_grasps=_GRASPS.validate_json(row["document"]), **_info(row))


@router.delete(PATH + "/{set_id}", status_code=204, summary="Delete a set", responses=_PROBLEMS)
async def delete_set(runtime: RuntimeDependency, principal: Planner, object_id: ObjectId, set_id: SetId) -> Response:
    """Delete a set; jobs that started from it stay as they are."""
    if not await runtime.objects.remove_grasps(principal.owner, object_id, set_id):
        raise _unknown(object_id, set_id)
    return Response(status_code=204)


async def _keep(
    runtime: Runtime,
    principal: Principal,
    response: Response,
    object_id: str,
    origin: Literal["generated", "imported"],
    name: str,
    grasps: list[ParallelGrasp],
) -> ParallelGraspSet:
    info = ParallelGraspSetInfo(
        id=uuid4().hex, object_id=object_id, origin=origin, name=name, count=len(grasps), created_at=datetime.now(UTC)
    )
    if not await runtime.objects.add_grasps(principal.owner, info, _GRASPS.dump_json(grasps).decode()):
        raise ProblemError(ProblemKind.NOT_FOUND, f"Object {object_id!r} was deleted meanwhile.")
    response.headers["Location"] = f"{PATH.format(object_id=object_id)}/{info.id}"
    return ParallelGraspSet(parallel_grasps=grasps, **info.model_dump())


def _info(row: Any) -> dict[str, Any]:
    members = {name: row[name] for name in ParallelGraspSetInfo.model_fields}
    return members | {"created_at": datetime.fromtimestamp(row["created_at"], UTC)}


def _unknown(object_id: str, set_id: str) -> ProblemError:
    return ProblemError(ProblemKind.NOT_FOUND, f"Object {object_id!r} has no set of parallel grasps {set_id!r}.")
