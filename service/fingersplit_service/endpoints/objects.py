"""Objects: upload a mesh or point cloud, list, get, export, delete."""

import math
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, File, Form, Query, Response, UploadFile
from fastapi.responses import FileResponse

from fingersplit.errors import SettingsError
from fingersplit.numerals import read_floats
from fingersplit.objects.options import ObjectOptions as CoreOptions
from fingersplit_client.schemas import CloudReport, IntakeReport, ObjectInfo, ObjectOptions, ObjectPage, Unit, Vector3
from fingersplit_client.schemas.objects import Density, Fairing, Friction, Mass
from fingersplit_service.dependencies import Files, Objects
from fingersplit_service.endpoints.documents import Cursor, Limit, ObjectId, next_cursor, place
from fingersplit_service.endpoints.forms import ExactForm
from fingersplit_service.endpoints.uploads import PRINTABLE, staged, stem, suffix
from fingersplit_service.jobs.object_work import Upload
from fingersplit_service.problems import ProblemError, ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

__all__ = ["OBJECT_FIELDS", "PATH", "object_options", "router", "support_of", "viewpoint_of"]

PATH = "/v1/objects"
router = APIRouter(tags=["objects"])

OBJECT_FIELDS = ("file", "unit", "scale", "name", "density", "mass", "friction", "fairing", "viewpoint", "support")
"""The fields of a form that describes an object."""
_KNOWN_ALREADY: dict[int | str, dict[str, Any]] = {
    200: {
        "model": ObjectInfo,
        "description": "The same shape with the same options is here already; this is its object.",
    }
}


class _MeshResponse(FileResponse):
    """A mesh file."""

    media_type = "application/octet-stream"


def _option(name: str) -> Any:
    return Form(description=ObjectOptions.model_fields[name].description)


def object_options(
    density: Annotated[Density | None, _option("density")] = None,
    mass: Annotated[Mass | None, _option("mass")] = None,
    friction: Annotated[Friction | None, _option("friction")] = None,
    fairing: Annotated[Fairing, _option("fairing")] = 0.0,
) -> ObjectOptions:
    """What the form says of the object beside its shape."""
    try:
        CoreOptions(density, mass, friction, fairing)
    except SettingsError as error:  # each is within its range, so it is their combination
        raise ProblemError(ProblemKind.INVALID_REQUEST, str(error), field="/mass") from error
    return ObjectOptions(density=density, mass=mass, friction=friction, fairing=fairing)


def viewpoint_of(
    viewpoint: Annotated[
        str | None,
        Form(
            description="Where the camera stood that saw a point cloud: x,y,z in the file's frame and unit.",
            max_length=200,
        ),
    ] = None,
) -> Vector3 | None:
    """The camera's place of a form."""
    if viewpoint is None:
        return None
    x, y, z = _numbers("viewpoint", viewpoint, 3, "three numbers, such as 0,0,0.6")
    return x, y, z


def support_of(
    support: Annotated[
        str | None,
        Form(
            description="Plane that the object of a point cloud stands on, so that the side which one view did not see "
            "is assumed: x,y,z of its normal on the object's side and the offset along it, in the file's frame and "
            "unit.",
            max_length=200,
        ),
    ] = None,
) -> tuple[float, float, float, float] | None:
    """The plane that an object stands on, of a form."""
    if support is None:
        return None
    x, y, z, offset = _numbers("support", support, 4, "a normal and an offset, such as 0,0,1,0.02")
    return x, y, z, offset


def _numbers(field: str, text: str, count: int, right: str) -> list[float]:
    try:
        numbers = read_floats(text.encode().split(b","))
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        detail = f"The {field} is {text!r}; it must be {right}."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field=f"/{field}")
    return numbers


_PROBLEMS = problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST)


@router.post(
    PATH,
    status_code=201,
    summary="Upload a mesh or point cloud",
    responses=_KNOWN_ALREADY
    | problem_answers(
        ProblemKind.UNKNOWN_FORMAT,
        ProblemKind.INVALID_REQUEST,
        ProblemKind.INVALID_MESH,
        ProblemKind.LIMIT_REACHED,
    ),
    dependencies=[Depends(ExactForm())],
)
async def upload_object(
    objects: Objects,
    storage: Files,
    principal: Planner,
    response: Response,
    file: Annotated[UploadFile, File(description="The file; its name's suffix says the format.")],
    described: Annotated[ObjectOptions, Depends(object_options)],
    viewpoint: Annotated[Vector3 | None, Depends(viewpoint_of)],
    support: Annotated[tuple[float, float, float, float] | None, Depends(support_of)],
    unit: Annotated[Unit, Form(description="Length unit of the file.")] = "m",
    scale: Annotated[
        float, Form(description="Multiplies the file's numbers, beside the unit.", gt=0, allow_inf_nan=False)
    ] = 1.0,
    name: Annotated[
        str, Form(description="Name for people; by default that of the file.", max_length=200, pattern=PRINTABLE)
    ] = "",
) -> ObjectInfo:
    """Check a mesh or a point cloud and keep it. The object frame is the frame of the file; all is converted to metres.

    A worker process reads the file and prepares the object. What it repaired stands in the report; what cannot be a
    graspable object is refused, with the fault's short name in `code`.
    """
    if not suffix(file):
        raise ProblemError(
            ProblemKind.UNKNOWN_FORMAT,
            f"The file's name, {file.filename!r}, has no suffix that says its format.",
            field="/file",
        )
    async with staged(storage, file) as path:
        upload = Upload(path, unit, described.model_dump(), viewpoint, scale, support)
        info, fresh = await objects.add(principal.owner, name, stem(file), upload)
    response.status_code = 201 if fresh else 200
    response.headers["Location"] = f"{PATH}/{info.id}"
    return info


@router.get(PATH, summary="List the objects", responses=problem_answers(ProblemKind.INVALID_REQUEST))
async def list_objects(objects: Objects, principal: Reader, limit: Limit = 100, cursor: Cursor = None) -> ObjectPage:
    """Objects, newest first."""
    stored = await objects.page(principal.owner, place(cursor), limit)
    return ObjectPage(
        items=[ObjectInfo.model_validate_json(one.document) for one in stored],
        next_cursor=next_cursor([one.number for one in stored], limit),
    )


@router.get(PATH + "/{object_id}", summary="Get an object", responses=_PROBLEMS)
async def get_object(objects: Objects, principal: Reader, object_id: ObjectId) -> ObjectInfo:
    """One object and what was found in its file."""
    return await objects.get(principal.owner, object_id)


@router.get(PATH + "/{object_id}/report", summary="See what was repaired", responses=_PROBLEMS)
async def get_report(objects: Objects, principal: Reader, object_id: ObjectId) -> IntakeReport | CloudReport:
    """What was found in an object's file and what was repaired."""
    return (await objects.get(principal.owner, object_id)).report


@router.get(
    PATH + "/{object_id}/mesh",
    response_class=_MeshResponse,
    summary="Get the mesh",
    responses=_PROBLEMS | problem_answers(ProblemKind.NOT_FOUND, ProblemKind.WORKER_FAILED),
)
async def get_mesh(
    objects: Objects,
    principal: Reader,
    object_id: ObjectId,
    file_type: Annotated[
        Literal["ply", "stl", "obj", "glb", "off"], Query(alias="format", description="Format of the file.")
    ] = "ply",
) -> _MeshResponse:
    """The checked mesh, object frame, in metres."""
    path = await objects.mesh_file(principal.owner, object_id, file_type)
    return _MeshResponse(path, filename=path.name, media_type=_MeshResponse.media_type)


@router.delete(
    PATH + "/{object_id}",
    status_code=204,
    summary="Delete an object",
    responses=_PROBLEMS | problem_answers(ProblemKind.IN_USE),
)
async def delete_object(objects: Objects, principal: Planner, object_id: ObjectId) -> Response:
    """Delete an object and its parallel grasps. Ended jobs keep their results; their pictures cannot be redrawn."""
    await objects.delete(principal.owner, object_id)
    return Response(status_code=204)
