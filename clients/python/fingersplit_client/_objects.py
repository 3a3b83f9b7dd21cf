"""What can be asked about objects and their parallel grasps, each operation as a flow of `_protocol`."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import TypeAdapter

from fingersplit_client._protocol import Flow, dump, exchange, given, parse, parse_list, quoted
from fingersplit_client.errors import FingersplitClientError
from fingersplit_client.schemas import (
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
    if isinstance(mesh, bytes):
        if file_type is None:
            raise FingersplitClientError("Bytes do not say what they are: give file_type, such as 'stl' or 'ply'.")
        stem, suffix, content = "object", f".{file_type.lstrip('.')}", mesh
    else:
        path = Path(mesh)
        stem, suffix, content = (
            path.stem,
            f".{file_type.lstrip('.')}" if file_type else path.suffix,
            path.read_bytes(),
        )
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


def _object(object_id: str) -> str:
    return f"/v1/objects/{quoted(object_id)}"
