"""One blocking call from a mesh to grasps: the object is kept, and the job is one like any other."""

import base64
import binascii
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, TypeVar

from fastapi import APIRouter, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field, ValidationError
from starlette.datastructures import UploadFile

from fingersplit_client.schemas import Job, JobCreate, Unit, Vector3
from fingersplit_client.schemas.base import Document
from fingersplit_client.schemas.objects import Density, Fairing, Friction, Mass
from fingersplit_service.dependencies import Files, Jobs, Objects, ParallelGrasps, Settings
from fingersplit_service.endpoints.documents import job_document, json_response
from fingersplit_service.endpoints.forms import ExactForm
from fingersplit_service.endpoints.job_requests import (
    IdempotencyKey,
    Prefer,
    preference_applied,
    refuse_untouching,
    wait_seconds,
)
from fingersplit_service.endpoints.objects import OBJECT_FIELDS, object_options, support_of, viewpoint_of
from fingersplit_service.endpoints.uploads import PRINTABLE, staged, staged_bytes, stem, suffix
from fingersplit_service.jobs.object_work import Upload
from fingersplit_service.problems import ProblemError, ProblemKind, problem_answers
from fingersplit_service.security.access import Planner
from fingersplit_service.storage import Storage

__all__ = ["PATH", "PLAN_FORM", "InlineObject", "ObjectDescription", "PlanCreate", "router"]

PATH = "/v1/plan"
router = APIRouter(tags=["jobs"])
Parsed = TypeVar("Parsed", bound=BaseModel)


class ObjectDescription(Document):
    """What is said of an object beside its file."""

    unit: Unit = Field(default="m", description="Length unit of the file.")
    scale: float = Field(default=1.0, gt=0, description="Multiplies the file's numbers, beside the unit.")
    name: str = Field(default="", max_length=200, pattern=PRINTABLE, description="Name for people.")
    density: Density | None = Field(default=None, description="Density [kg/m^3].")
    mass: Mass | None = Field(default=None, description="Mass [kg].")
    friction: Friction | None = Field(default=None, description="Coulomb friction between pads and object.")
    fairing: Fairing = Field(default=0.0, description="Wavelength attenuated by half [m]; 0 for none.")
    viewpoint: Vector3 | None = Field(
        default=None, description="Where the camera of a point cloud stood, in the file's frame and unit."
    )
    support: tuple[float, float, float, float] | None = Field(
        default=None,
        description="Plane that the object of a point cloud stands on, so that the side which one view did not see is "
        "assumed: normal and offset, in the file's frame and unit.",
    )


class InlineObject(ObjectDescription):
    """An object that comes with the request."""

    data: str = Field(description="Content of the mesh or point cloud file, base64.", min_length=1)
    file_type: str = Field(
        description="Format of the file, such as ply.", min_length=1, max_length=16, pattern=r"^[A-Za-z0-9]+$"
    )


class PlanCreate(JobCreate):
    """A job, and the object that it is for where that is not here yet."""

    object_id: str = Field(default="", description="Id of an uploaded object; left out with `mesh`.", max_length=64)
    mesh: InlineObject | None = Field(default=None, description="The object; left out with `object_id`.")


_FORM = ExactForm(*OBJECT_FIELDS, "job")
PLAN_FORM: dict[str, Any] = {
    "title": "PlanForm",
    "description": "What to plan, as a form with the object's file.",
    "type": "object",
    "required": ["file"],
    "properties": {
        "file": {"type": "string", "format": "binary", "description": "The mesh or point cloud."},
        "job": {
            "type": "string",
            "contentMediaType": "application/json",
            "description": "A `JobCreate` without `object_id`; other fields are those of uploads.",
        },
    },
}
"""Schema of the form; it has a name, since generators of clients make up one that is taken."""
_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "application/json": {"schema": {"$ref": "#/components/schemas/PlanCreate"}},
            "multipart/form-data": {"schema": {"$ref": "#/components/schemas/PlanForm"}},
        },
    }
}
_NOT_ENDED: dict[int | str, dict[str, Any]] = {
    202: {"model": Job, "description": "The time to wait is over, and the job has not ended; ask for it again."}
}


@router.post(
    PATH,
    response_model=Job,
    summary="Plan grasps in one call",
    openapi_extra=_BODY,
    responses=_NOT_ENDED
    | problem_answers(
        ProblemKind.INVALID_REQUEST,
        ProblemKind.INVALID_MESH,
        ProblemKind.UNKNOWN_FORMAT,
        ProblemKind.KEY_REUSED,
        ProblemKind.QUEUE_FULL,
        ProblemKind.LIMIT_REACHED,
        ProblemKind.TOO_MANY_WAITING,
        ProblemKind.NOT_READY,
    ),
)
async def plan_grasps(
    request: Request,
    jobs: Jobs,
    objects: Objects,
    parallel_grasps: ParallelGrasps,
    storage: Files,
    settings: Settings,
    principal: Planner,
    prefer: Prefer = None,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Answer with the ended job and its ranked grasps; 202 with the job when it takes longer than the time to wait.

    The object comes as a file of a form, as base64 in JSON, or by the id of an earlier upload. It is kept like any
    upload, and the job is listed, recorded and deleted like any other.
    """
    async with _uploaded(request, storage) as (asked, name, upload):
        object_id = asked.object_id
        if upload is not None:
            description = asked.mesh.name if asked.mesh else ""
            info, _ = await objects.add(principal.owner, description, name, upload)
            object_id = info.id
    job = JobCreate.model_validate(asked.model_dump(exclude={"mesh"}) | {"object_id": object_id})
    seconds = wait_seconds(prefer, settings.max_wait_s) or settings.max_wait_s
    await refuse_untouching(parallel_grasps, principal, job)
    view = await jobs.submit(principal.owner, job, idempotency_key=idempotency_key, wait_s=seconds)
    headers = {"Location": f"/v1/jobs/{view.row.id}"} | preference_applied(seconds if prefer else 0.0)
    if not view.fresh:
        headers["Idempotent-Replayed"] = "true"
    return json_response(job_document(view), 200 if view.row.ended else 202, headers)


@asynccontextmanager
async def _uploaded(request: Request, storage: Storage) -> AsyncIterator[tuple[PlanCreate, str, Upload | None]]:
    """What is asked for, what its file is called, and the file while it is looked at."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type == "multipart/form-data":
        await _FORM(request)
        form = await request.form()
        file, fields = form.get("file"), {name: value for name, value in form.items() if name != "file"}
        if not isinstance(file, UploadFile):
            raise ProblemError(
                ProblemKind.INVALID_REQUEST, "A file is needed, with curl -F file=@part.stl.", field="/file"
            )
        asked = _parsed(request, PlanCreate, str(fields.pop("job", "{}")), "job")
        _refuse_two_objects(asked.object_id or asked.mesh)
        viewpoint = viewpoint_of(str(fields.pop("viewpoint"))) if "viewpoint" in fields else None
        support = support_of(str(fields.pop("support"))) if "support" in fields else None
        about = _parsed(request, ObjectDescription, fields | {"viewpoint": viewpoint, "support": support})
        mesh = InlineObject(data="-", file_type=(suffix(file) or ".none")[1:], **about.model_dump())
        asked = asked.model_copy(update={"mesh": mesh})
        async with staged(storage, file) as path:
            await form.close()
            yield asked, stem(file), _upload(path, mesh)
    elif media_type == "application/json":
        asked = _parsed(request, PlanCreate, await request.body())
        if asked.mesh is None:
            if not asked.object_id:
                detail = "Say what to plan for: a mesh, a file of a form, or the object_id of an upload."
                raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/mesh")
            yield asked, "", None
            return
        _refuse_two_objects(asked.object_id)
        async with staged_bytes(storage, _decoded(asked.mesh.data), f".{asked.mesh.file_type.lower()}") as path:
            yield asked, "object", _upload(path, asked.mesh)
    else:
        detail = (
            f"The request's Content-Type is {media_type or 'missing'}; send application/json, or multipart/form-data "
            "with a file."
        )
        raise ProblemError(ProblemKind.MEDIA_TYPE, detail)


def _upload(path: Any, mesh: InlineObject) -> Upload:
    options = object_options(mesh.density, mesh.mass, mesh.friction, mesh.fairing)
    return Upload(path, mesh.unit, options.model_dump(), mesh.viewpoint, mesh.scale, mesh.support)


def _refuse_two_objects(given: object) -> None:
    if given:
        detail = "Give one object: a file, a mesh or an object_id."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/object_id")


def _decoded(data: str) -> bytes:
    try:
        return base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError):
        detail = "The mesh's data is not base64."
        raise ProblemError(ProblemKind.INVALID_REQUEST, detail, field="/mesh/data") from None


def _parsed(request: Request, model: type[Parsed], given: Any, *prefix: str) -> Parsed:
    """A part of the request as a model; faults are told as FastAPI tells those of a body."""
    request.scope["body_model"] = model
    try:
        return model.model_validate_json(given) if isinstance(given, (str, bytes)) else model.model_validate(given)
    except ValidationError as error:
        faults = [fault | {"loc": ("body", *prefix, *fault["loc"])} for fault in error.errors()]
        raise RequestValidationError(faults) from error
