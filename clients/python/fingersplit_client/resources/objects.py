"""Objects: meshes and point clouds, uploaded once."""

from typing import Any, Generic, Unpack

from fingersplit_client._exchange import Deadline, dump, given, parse, quoted
from fingersplit_client._flow import Emit, Flow, Stream, Work
from fingersplit_client.errors import InvalidRequestError, NotFoundError
from fingersplit_client.mesh_files import MeshFile, MeshSource, read_mesh
from fingersplit_client.modes import Mode, operation, stream
from fingersplit_client.options import ObjectKeywords, object_lookup
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import ObjectInfo, ObjectLookup, ObjectPage

__all__ = ["Objects", "object_path", "upload_file"]


class Objects(Resource[Mode], Generic[Mode]):
    """Meshes and point clouds that grasps are planned for."""

    @operation
    def upload(
        self,
        mesh: MeshSource,
        **options: Unpack[ObjectKeywords],
    ) -> Flow[ObjectInfo]:
        """Upload a mesh or a point cloud; the same one with the same options is always the same object.

        Its bytes are sent only if the service does not know them.

        Args:
            mesh: A path, an open binary file, the bytes of a file, or vertices (n, 3) and triangles (m, 3).
            **options: ``unit`` of the file (``"m"``, ``"mm"``, ``"cm"`` or ``"in"``) and ``scale`` of its numbers;
                ``name`` for people, by default that of the file; ``file_type`` such as ``"stl"``, by default the file's
                suffix and needed with bytes; ``viewpoint`` of the camera that saw a point cloud and ``support``, the
                plane that its object stands on (normal and offset), in the file's frame and unit; what is known of the
                object: ``density`` [kg/m^3] or ``mass`` [kg], ``friction``, ``fairing`` [m].

        Raises:
            InvalidRequestError: An option or the file is not valid.
            OSError: The file cannot be read.
        """
        lookup = object_lookup(options)
        file: MeshFile = yield Work(lambda: read_mesh(mesh, options.get("file_type")))
        return (yield from upload_file(self, file, lookup, options.get("name")))

    @operation
    def get(self, object_id: str) -> Flow[ObjectInfo]:
        """One object and what was found in its file."""
        response = yield from self._exchange("GET", object_path(object_id))
        return parse(ObjectInfo, response)

    @operation
    def list(self, *, limit: int = 100, cursor: str | None = None) -> Flow[ObjectPage]:
        """A page of the objects, newest first; ``next_cursor`` of one page is ``cursor`` of the next."""
        response = yield from self._exchange("GET", "/v1/objects", params=given(limit=limit, cursor=cursor))
        return parse(ObjectPage, response)

    @stream
    def all(self) -> Stream[ObjectInfo]:
        """Every object, newest first, page after page."""
        cursor = None
        while True:
            page = yield from Objects.list.flow(self, limit=200, cursor=cursor)
            for item in page.items:
                yield Emit(item)
            cursor = page.next_cursor
            if cursor is None:
                return

    @operation
    def delete(self, object_id: str) -> Flow[None]:
        """Delete an object and its parallel grasps."""
        yield from self._exchange("DELETE", object_path(object_id))

    @operation
    def mesh(self, object_id: str, file_type: str = "ply") -> Flow[bytes]:
        """The checked mesh of an object in metres, as a ply, stl, obj, glb or off file."""
        response = yield from self._exchange("GET", f"{object_path(object_id)}/mesh", params={"format": file_type})
        return bytes(response.content)


def upload_file(
    objects: Resource[Any], file: MeshFile, lookup: ObjectLookup, name: str | None, deadline: Deadline | None = None
) -> Flow[ObjectInfo]:
    """The object of a file, which is sent only if the service does not know it."""
    sha256 = yield Work(lambda: file.sha256)
    asked = dump(lookup) | {"sha256": sha256}
    try:
        response = yield from objects._exchange(
            "POST", "/v1/objects/lookup", json=asked, repeatable=True, deadline=deadline
        )
        found = parse(ObjectInfo, response)
        if name is None or name == found.name:  # else the upload gives it the new one
            return found
    except NotFoundError:
        pass
    except InvalidRequestError as error:
        if error.problem.status != 405:  # which is what a service without this address says
            raise
    fields = {"name": name or file.stem} | {key: _text(value) for key, value in dump(lookup).items() if key != "sha256"}
    files = {"file": (file.filename, file.content, "application/octet-stream")}
    response = yield from objects._exchange(
        "POST", "/v1/objects", data=fields, files=files, repeatable=True, deadline=deadline
    )
    return parse(ObjectInfo, response)


def _text(value: Any) -> str:
    """A value of a form."""
    return ",".join(map(repr, value)) if isinstance(value, list) else str(value)


def object_path(object_id: str) -> str:
    """Address of an object."""
    return f"/v1/objects/{quoted(object_id)}"
