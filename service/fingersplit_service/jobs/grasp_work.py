"""What workers do with parallel grasps: find them, read them from files, and check that they touch their object."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingersplit_client.schemas import ParallelGraspsGenerate
from fingersplit_service.jobs.hand_work import stored_hand
from fingersplit_service.jobs.stored_objects import prepared_object
from fingersplit_service.storage import Storage

__all__ = ["GraspFile", "check_touching", "generate_parallel_grasps", "import_grasps"]

_MAX_GRASPS = 1024  # of one set


@dataclass(frozen=True)
class GraspFile:
    """An uploaded file of parallel grasps.

    Attributes:
        path: Where it is.
        name: What its sender calls it.
        format: Its format; None to go by its content.
        gripper: The gripper that its grasps are for; None to go by what it says.
        scale: Factor from its lengths to metres.
    """

    path: Path
    name: str
    format: str | None
    gripper: str | None = None
    scale: float = 1.0


def generate_parallel_grasps(storage: Storage, object_id: str, request: ParallelGraspsGenerate) -> list[dict[str, Any]]:
    """Find parallel grasps of an object that fit a hand's opening."""
    import numpy as np

    from fingersplit.contacts.friction import planned_friction
    from fingersplit.parallel_grasps.sources import find_parallel_grasps

    model = prepared_object(storage, object_id, object_id)
    grasps = find_parallel_grasps(
        model,
        2 * request.count,  # a pair is two starts, one for either assignment of the fingers
        source=request.source,
        friction=planned_friction(request.friction, model.options.friction),
        opening=stored_hand(storage, request.hand).gripper.opening,
        rng=np.random.default_rng(request.seed),
    )
    return [grasp.to_document() for grasp in grasps]


def check_touching(storage: Storage, object_id: str, grasps: list[dict[str, Any]]) -> None:
    """Refuse parallel grasps that do not touch an object.

    Raises:
        ParallelGraspError: One does not; it says which.
    """
    from fingersplit.parallel_grasps.on_surface import check_on_surface
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp

    model = prepared_object(storage, object_id, object_id)
    check_on_surface(model, [ParallelGrasp.from_document(grasp) for grasp in grasps])


def import_grasps(
    storage: Storage, object_id: str, object_name: str, file: GraspFile
) -> tuple[list[dict[str, Any]], str]:
    """Read parallel grasps of an object from a file.

    Returns:
        The best of them as documents, and a sentence on what the file held.

    Raises:
        FormatError: The file is not what it should be, or none of its grasps meets the object.
    """
    from fingersplit.errors import FormatError
    from fingersplit.formats import import_parallel_grasps

    model = prepared_object(storage, object_id, object_name)
    try:
        found = import_parallel_grasps(file.path, model, file.format, gripper=file.gripper, scale=file.scale)
    except FormatError as error:
        raise FormatError(str(error).replace(str(file.path), file.name)) from None
    kept = [grasp.to_document() for grasp in found.grasps[:_MAX_GRASPS]]
    left = f" The best {_MAX_GRASPS} were kept." if len(found.grasps) > _MAX_GRASPS else ""
    return kept, found.message + left
