"""The scene, approach, regions, task and end effector of a job: checked when it is asked for, loaded by its worker."""

import asyncio
import re
from typing import TYPE_CHECKING, Any

from fingersplit.errors import SceneError
from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.errors import InvalidField
from fingersplit_service.jobs.stored_objects import prepared_object
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.objects.model import ObjectModel
    from fingersplit.scene import Constraints
    from fingersplit_service.database.objects import ObjectStore  # workers have no use for the database

__all__ = ["check_constraints", "load_constraints", "load_obstacle"]

_PARTS = ("scene", "approach", "contact_regions", "task", "end_effector")
_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")


async def check_constraints(objects: "ObjectStore", owner: str, request: JobCreate, prefix: str = "") -> None:
    """Refuse constraints that cannot be used, and obstacles that the owner has not uploaded.

    Raises:
        InvalidField: With a pointer to the entry.
    """
    document = _document(request)
    if not document:
        return
    try:
        # Large clouds take a while to read; the first one imports the numeric stack, too.
        names = await asyncio.to_thread(_obstacle_ids, document)
    except SceneError as error:
        raise InvalidField(f"{prefix}{_pointer(error.field)}", str(error)) from error
    for index, object_id in names:
        known = await objects.document(owner, object_id) if _ID.fullmatch(object_id) else None
        if known is None:
            field = f"{prefix}/scene/obstacles/{index}/object_id"
            raise InvalidField(field, f"There is no object {object_id!r}; upload it to /v1/objects first.")


def load_constraints(storage: Storage, request: JobCreate) -> "Constraints":
    """The constraints of a job, with the models of its obstacles."""
    from fingersplit.scene import Constraints

    return Constraints.from_document(_document(request)).resolved(lambda object_id: load_obstacle(storage, object_id))


def load_obstacle(storage: Storage, object_id: str) -> "ObjectModel":
    """The model of an obstacle.

    Raises:
        SceneError: It was deleted since the job was accepted.
    """
    if not storage.exists(storage.shape(object_id)):
        raise SceneError("scene.obstacles", f"name the object {object_id!r}, which was deleted.")
    return prepared_object(storage, object_id, object_id)


def _document(request: JobCreate) -> dict[str, Any]:
    parts = {name: getattr(request, name) for name in _PARTS}
    return {name: part for name, part in parts.items() if part is not None}


def _obstacle_ids(document: dict[str, Any]) -> list[tuple[int, str]]:
    """Place and id of every obstacle that names an object."""
    from fingersplit.scene import Constraints

    obstacles = Constraints.from_document(document).scene.obstacles
    return [(index, one.object_id) for index, one in enumerate(obstacles) if one.object_id is not None]


def _pointer(field: str) -> str:
    """JSON pointer of an entry such as ``scene.obstacles[2].primitive``."""
    return "".join(f"/{part}" for part in re.findall(r"[^.\[\]]+", field))
