"""The one-call plan: upload what is not known, queue, wait."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fingersplit_client import _waiting
from fingersplit_client._exchange import Deadline
from fingersplit_client._flow import Flow, Work
from fingersplit_client.errors import FingersplitClientError, InvalidRequestError, invalid
from fingersplit_client.mesh_files import MeshFile, MeshSource, read_mesh
from fingersplit_client.options import job_request, object_lookup
from fingersplit_client.resources.objects import Objects, upload_file
from fingersplit_client.results import PlanResult
from fingersplit_client.schemas import JobCreate, ObjectInfo, ObjectLookup

__all__ = ["KnownObjects", "PlanRequest", "plan"]

_KNOWN = 1024
"""How many objects a client remembers to have uploaded."""


@dataclass(frozen=True)
class PlanRequest:
    """What to plan, beside the object's file; made first, so that what is not valid is refused before anything is sent.

    Attributes:
        lookup: What is said of the object.
        request: What is asked of the job, still without the object's id.
        name: Name for people; None for that of the file.
        file_type: Format of the file; None for what its suffix says.
    """

    lookup: ObjectLookup
    request: JobCreate
    name: str | None = None
    file_type: str | None = None

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> "PlanRequest":
        """A plan of what the one-call plan was given.

        Raises:
            InvalidRequestError: An option is not valid.
        """
        request = job_request("", options)  # first: it knows unknown options
        return cls(object_lookup(options), request, options.get("name"), options.get("file_type"))


@dataclass
class KnownObjects:
    """Ids of the objects that a client has uploaded, by what they were uploaded with."""

    ids: dict[str, str] = field(default_factory=dict)

    def remember(self, key: str, object_id: str) -> None:
        """Keep an id; the oldest is forgotten when there are too many."""
        if len(self.ids) >= _KNOWN:
            self.ids.pop(next(iter(self.ids)), None)
        self.ids[key] = object_id


def plan(
    objects: Objects[Any],
    known: KnownObjects,
    mesh: "MeshSource | MeshFile | ObjectInfo",
    asked: PlanRequest,
    deadline: Deadline,
    *,
    cancel: bool,
    on_progress: _waiting.Progress | None = None,
    on_job: Callable[[str], None] | None = None,
    key: str | None = None,
) -> Flow[PlanResult[Any]]:
    """Plan for an object, uploaded or not; see `Client.plan`."""

    def run(object_id: str) -> Flow[PlanResult[Any]]:
        request = asked.request.model_copy(update={"object_id": object_id})
        job = yield from _waiting.run(
            objects, request, deadline, cancel=cancel, on_progress=on_progress, on_job=on_job, key=key
        )
        if job.result is None:
            raise FingersplitClientError(f"Job {job.id} has succeeded and carries no result.")
        return job.result

    if isinstance(mesh, ObjectInfo):
        if asked.lookup.model_fields_set != {"sha256"}:
            raise invalid("What is said of an object is said when it is uploaded; give the file, or no such option.")
        return (yield from run(mesh.id))
    file: MeshFile = mesh if isinstance(mesh, MeshFile) else (yield Work(lambda: read_mesh(mesh, asked.file_type)))
    name = f"{(yield Work(lambda: file.sha256))} {asked.lookup.model_dump_json()}"
    if name in known.ids:
        try:
            return (yield from run(known.ids[name]))
        except InvalidRequestError as error:
            if [one.field for one in error.problem.errors] != ["/object_id"]:
                raise
            del known.ids[name]  # it was deleted meanwhile
    info = yield from upload_file(objects, file, asked.lookup, asked.name, deadline)
    known.remember(name, info.id)
    return (yield from run(info.id))
