"""What can be asked about objects and their parallel grasps, each operation as a flow of `_protocol`."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import TypeAdapter

from fingersplit_client._protocol import Flow, dump, exchange, given, parse, parse_list, quoted
from fingersplit_client.errors import FingersplitClientError
from fingersplit_client.schemas import (
    GraspFormat,
    ImportedGraspSet,
    ObjectInfo,
    ObjectOptions,
    ObjectPage,
    ParallelGrasp,
    ParallelGraspsCreate,
    ParallelGraspSet,
    ParallelGraspSetInfo,
    ParallelGraspsGenerate,
)

__all__ = [
    "delete_object",
    "delete_parallel_grasps",
    "generate_parallel_grasps",
    "get_object",
    "import_grasp_file",
    "import_parallel_grasps",
    "list_objects",
    "list_parallel_grasps",
    "mesh",
    "parallel_grasps",
    "upload_object",
]

_SETS = TypeAdapter(list[ParallelGraspSetInfo])


def upload_object(
    mesh: Path | str | bytes,
    unit: str,
    name: str | None,
    file_type: str | None,
    options: ObjectOptions | None = None,
    viewpoint: Sequence[float] | None = None,
) -> Flow[ObjectInfo]:
    """Upload the file of a mesh or point cloud, or its bytes and their type."""
    if isinstance(mesh, bytes) and file_type is None:
        raise FingersplitClientError("Bytes do not say what they are: give file_type, such as 'stl' or 'ply'.")
    stem, suffix, content = _file(mesh, "object")
    if file_type:
        suffix = f".{file_type.lstrip('.')}"
    fields = {} if options is None else {key: str(value) for key, value in given(**options.model_dump()).items()}
    if viewpoint is not None:
        fields["viewpoint"] = ",".join(f"{float(number)!r}" for number in viewpoint)
    arguments = {
        "data": {"unit": unit, "name": name or stem} | fields,
        "files": {"file": (stem + suffix, content, "application/octet-stream")},
    }
    response = yield from exchange("POST", "/v1/objects", **arguments)
    return parse(ObjectInfo, response)


def get_object(object_id: str) -> Flow[ObjectInfo]:
    """One object."""
    response = yield from exchange("GET", _object(object_id))
    return parse(ObjectInfo, response)


def list_objects(limit: int, cursor: str | None) -> Flow[ObjectPage]:
    """A page of the objects."""
    response = yield from exchange("GET", "/v1/objects", params=given(limit=limit, cursor=cursor))
    return parse(ObjectPage, response)


def delete_object(object_id: str) -> Flow[None]:
    """Delete an object."""
    yield from exchange("DELETE", _object(object_id))


def mesh(object_id: str, file_type: str) -> Flow[bytes]:
    """The checked mesh as a file."""
    response = yield from exchange("GET", f"{_object(object_id)}/mesh", params={"format": file_type})
    return response.content


def generate_parallel_grasps(object_id: str, request: ParallelGraspsGenerate) -> Flow[ParallelGraspSet]:
    """Have parallel grasps found."""
    response = yield from exchange("POST", f"{_object(object_id)}/parallel-grasps/generate", json=dump(request))
    return parse(ParallelGraspSet, response)


def import_parallel_grasps(object_id: str, grasps: Sequence[ParallelGrasp], name: str) -> Flow[ParallelGraspSet]:
    """Store parallel grasps."""
    request = ParallelGraspsCreate(parallel_grasps=list(grasps), name=name)
    response = yield from exchange("POST", f"{_object(object_id)}/parallel-grasps", json=dump(request))
    return parse(ParallelGraspSet, response)


def import_grasp_file(
    object_id: str, file: Path | str | bytes, file_format: GraspFormat | None, name: str
) -> Flow[ImportedGraspSet]:
    """Store the parallel grasps in a file."""
    stem, suffix, content = _file(file, "grasps")
    arguments = {
        "data": given(name=name, format=file_format),
        "files": {"file": (stem + suffix, content, "application/octet-stream")},
    }
    response = yield from exchange("POST", f"{_object(object_id)}/parallel-grasps/import", **arguments)
    return parse(ImportedGraspSet, response)


def list_parallel_grasps(object_id: str) -> Flow[list[ParallelGraspSetInfo]]:
    """The sets of an object."""
    response = yield from exchange("GET", f"{_object(object_id)}/parallel-grasps")
    return parse_list(_SETS, response)


def parallel_grasps(object_id: str, set_id: str) -> Flow[ParallelGraspSet]:
    """One set."""
    response = yield from exchange("GET", f"{_object(object_id)}/parallel-grasps/{quoted(set_id)}")
    return parse(ParallelGraspSet, response)


def delete_parallel_grasps(object_id: str, set_id: str) -> Flow[None]:
    """Delete a set."""
    yield from exchange("DELETE", f"{_object(object_id)}/parallel-grasps/{quoted(set_id)}")


def _file(file: Path | str | bytes, name: str) -> tuple[str, str, bytes]:
    """Name, suffix and content of a file; of bytes the given name."""
    if isinstance(file, bytes):
        return name, "", file
    return Path(file).stem, Path(file).suffix, Path(file).read_bytes()


def _object(object_id: str) -> str:
    return f"/v1/objects/{quoted(object_id)}"
