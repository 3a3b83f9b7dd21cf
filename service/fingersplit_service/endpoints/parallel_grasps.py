"""Parallel grasps of an object: have them found, bring your own, list."""

from typing import Annotated

from fastapi import APIRouter, Depends, File, Form, Path, Response, UploadFile

from fingersplit_client.schemas import (
    ImportedGraspSet,
    ParallelGraspsCreate,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
)
from fingersplit_service.dependencies import Files, ParallelGrasps
from fingersplit_service.endpoints.documents import ID_PATTERN, ObjectId
from fingersplit_service.endpoints.forms import ExactForm
from fingersplit_service.endpoints.uploads import PRINTABLE, staged, stem
from fingersplit_service.jobs.grasp_work import GraspFile
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/objects/{object_id}/parallel-grasps"
router = APIRouter(tags=["objects"])
_PROBLEMS = problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST)

SetId = Annotated[str, Path(description="Id of a set.", max_length=64, pattern=ID_PATTERN)]


@router.post(
    PATH + "/generate",
    status_code=201,
    summary="Have parallel grasps found",
    responses=problem_answers(
        ProblemKind.NOT_FOUND,
        ProblemKind.INVALID_REQUEST,
        ProblemKind.LIMIT_REACHED,
        ProblemKind.NOT_READY,
        ProblemKind.WORKER_FAILED,
    ),
)
async def generate_parallel_grasps(
    grasps: ParallelGrasps, principal: Planner, object_id: ObjectId, asked: ParallelGraspsGenerate, response: Response
) -> ParallelGraspSet:
    """Find two-contact grasps of an object that fit a hand's opening, and keep them as a set."""
    return _located(response, await grasps.generate(principal.owner, object_id, asked))


@router.post(
    PATH,
    status_code=201,
    summary="Bring your own parallel grasps",
    responses=_PROBLEMS,
)
async def add_parallel_grasps(
    grasps: ParallelGrasps, principal: Planner, object_id: ObjectId, given: ParallelGraspsCreate, response: Response
) -> ParallelGraspSet:
    """Keep parallel grasps that were found elsewhere as a set."""
    kept = await grasps.add(principal.owner, object_id, given.name, given.parallel_grasps)
    return _located(response, kept)


@router.post(
    PATH + "/import",
    status_code=201,
    summary="Bring the parallel grasps in a file",
    responses=_PROBLEMS,
    dependencies=[Depends(ExactForm())],
)
async def import_parallel_grasps(
    grasps: ParallelGrasps,
    storage: Files,
    principal: Planner,
    object_id: ObjectId,
    response: Response,
    file: Annotated[
        UploadFile,
        File(
            description="A file of a format whose parallel grasps are read (`GET /v1/formats`), in the object's frame."
        ),
    ],
    file_format: Annotated[
        str | None,
        Form(alias="format", description="Name of its format; by default its content tells.", max_length=64),
    ] = None,
    gripper: Annotated[
        str | None,
        Form(description="Gripper that its grasps are for, such as panda; by default what it says.", max_length=64),
    ] = None,
    scale: Annotated[float, Form(description="Factor from its lengths to metres.", gt=0, allow_inf_nan=False)] = 1.0,
    name: Annotated[
        str, Form(description="Name for people; by default that of the file.", max_length=200, pattern=PRINTABLE)
    ] = "",
) -> ImportedGraspSet:
    """Keep the parallel grasps in a file as a set; where it holds grippers, their jaws are closed on the object."""
    async with staged(storage, file) as path:
        content = GraspFile(path, stem(file), file_format, gripper, scale)
        kept, message = await grasps.import_file(principal.owner, object_id, name or stem(file), content)
    return ImportedGraspSet(message=message, **dict(_located(response, kept)))


@router.get(PATH, summary="List the sets", responses=_PROBLEMS)
async def list_parallel_grasps(
    grasps: ParallelGrasps, principal: Reader, object_id: ObjectId
) -> list[ParallelGraspSetInfo]:
    """The sets of an object without their grasps, newest first; the newest thousand."""
    return await grasps.sets(principal.owner, object_id)


@router.get(PATH + "/{set_id}", summary="Get a set", responses=_PROBLEMS)
async def get_parallel_grasps(
    grasps: ParallelGrasps, principal: Reader, object_id: ObjectId, set_id: SetId
) -> ParallelGraspSet:
    """One set with its grasps."""
    return await grasps.get(principal.owner, object_id, set_id)


@router.delete(PATH + "/{set_id}", status_code=204, summary="Delete a set", responses=_PROBLEMS)
async def delete_parallel_grasps(
    grasps: ParallelGrasps, principal: Planner, object_id: ObjectId, set_id: SetId
) -> Response:
    """Delete a set; jobs that started from it stay as they are."""
    await grasps.delete(principal.owner, object_id, set_id)
    return Response(status_code=204)


def _located(response: Response, kept: ParallelGraspSet) -> ParallelGraspSet:
    response.headers["Location"] = f"{PATH.format(object_id=kept.object_id)}/{kept.id}"
    return kept
