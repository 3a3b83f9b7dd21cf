"""Objects: upload a mesh, list, get."""

import asyncio
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, File, Form, Query, Response, UploadFile
from fastapi import Path as PathParameter

from fingersplit.errors import MeshError
from fingersplit_client.schemas import ObjectInfo, Unit
from fingersplit_service.jobs.engine import DeadlineExceeded, WorkerDied
from fingersplit_service.openapi import problem_answers
from fingersplit_service.problems import ProblemError, ProblemKind
from fingersplit_service.runtime import Runtime, RuntimeDependency

__all__ = ["PATH", "router"]

PATH = "/v1/objects"
router = APIRouter(tags=["objects"])

_KNOWN_ALREADY: dict[int | str, dict[str, Any]] = {
    200: {"model": ObjectInfo, "description": "The same mesh is here already; this is its object."}
}


@router.post(
    PATH,
    status_code=201,
    summary="Upload a mesh",
    responses=_KNOWN_ALREADY
    | problem_answers(
        ProblemKind.BAD_REQUEST,
        ProblemKind.TOO_LARGE,
        ProblemKind.UNKNOWN_FORMAT,
        ProblemKind.INVALID_REQUEST,
        ProblemKind.INVALID_MESH,
    ),
)
async def upload_object(
    runtime: RuntimeDependency,
    response: Response,
    file: Annotated[UploadFile, File(description="The mesh file; its name's suffix says the format.")],
    unit: Annotated[Unit, Form(description="Length unit of the file.")] = "m",
    name: Annotated[str, Form(description="Name for people; by default that of the file.", max_length=200)] = "",
) -> ObjectInfo:
    """Check a mesh and keep it. The object frame is the frame of the file; everything is converted to metres.

    A worker process reads the file. What it repaired stands in the report; what cannot be a graspable object
    is refused, with the fault's short name in `code`.
    """
    filename = Path(file.filename or "object")
    suffix = filename.suffix.lower()
    if not suffix[1:].isalnum():
        raise ProblemError(
            ProblemKind.UNKNOWN_FORMAT,
            f"The file's name, {file.filename!r}, has no suffix that says its format.",
            field="/file",
        )
    upload = runtime.storage.staged(suffix)
    try:
        await asyncio.to_thread(_save, file, upload)
        found = await _inspect(runtime, upload, unit)
    finally:
        upload.unlink(missing_ok=True)
    info = ObjectInfo(name=name or filename.stem, unit=unit, created_at=datetime.now(UTC), **found)
    if not await runtime.store.add_object(info):
        response.status_code = 200
        info = await _known_object(runtime, info.id)
    response.headers["Location"] = f"{PATH}/{info.id}"
    return info


@router.get(PATH, summary="List the objects", responses=problem_answers(ProblemKind.INVALID_REQUEST))
async def list_objects(
    runtime: RuntimeDependency,
    limit: Annotated[int, Query(ge=1, le=1000, description="How many to return at most.")] = 100,
) -> list[ObjectInfo]:
    """The newest objects, newest first."""
    return [ObjectInfo.model_validate_json(one) for one in await runtime.store.object_documents(limit)]


@router.get(
    PATH + "/{object_id}",
    summary="Get an object",
    responses=problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST),
)
async def get_object(
    runtime: RuntimeDependency,
    object_id: Annotated[str, PathParameter(description="Id of an object.", max_length=64)],
) -> ObjectInfo:
    """One object and what was found in its file."""
    return await _known_object(runtime, object_id)


async def _known_object(runtime: Runtime, object_id: str) -> ObjectInfo:
    document = await runtime.store.object_document(object_id)
    if document is None:
        raise ProblemError(ProblemKind.NOT_FOUND, f"There is no object {object_id!r}; upload its mesh to {PATH}.")
    return ObjectInfo.model_validate_json(document)


def _save(file: UploadFile, path: Path) -> None:
    with path.open("wb") as target:
        shutil.copyfileobj(file.file, target, length=1 << 20)


async def _inspect(runtime: Runtime, upload: Path, unit: Unit) -> dict[str, Any]:
    """What a worker says of an uploaded file; a file it cannot digest is the sender's fault, not ours."""
    deadline = runtime.settings.inspection_deadline_s
    try:
        return await runtime.engine.answer(runtime.tasks.inspect, runtime.storage, upload, unit, deadline_s=deadline)
    except MeshError as error:
        kind = ProblemKind.UNKNOWN_FORMAT if error.code == "unknown_format" else ProblemKind.INVALID_MESH
        raise ProblemError(kind, str(error), field="/file", code=error.code) from error
    except DeadlineExceeded as error:
        detail = f"Checking the mesh took longer than {deadline:g} s; simplify it."
        raise ProblemError(ProblemKind.INVALID_MESH, detail, field="/file", code="too_complex") from error
    except (MemoryError, WorkerDied) as error:
        detail = "Checking the mesh took more memory than a worker may have; simplify it."
        raise ProblemError(ProblemKind.INVALID_MESH, detail, field="/file", code="too_complex") from error
