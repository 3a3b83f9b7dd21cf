"""What worker processes do: look at an upload, plan, draw.

The planner is imported inside the functions, so that only workers load it: the service process stays small
and starts fast. What goes in and comes out is plain and small; meshes and traces travel as files.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingersplit_service.jobs.worker import report_progress
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.model import ObjectModel

__all__ = [
    "DrawTask",
    "InspectTask",
    "JobOutcome",
    "PlanTask",
    "Tasks",
    "WarmTask",
    "draw_picture",
    "inspect_object",
    "plan_job",
    "warm",
]

_PREPARED_OBJECTS = 8  # kept ready by each worker


@dataclass(frozen=True)
class JobOutcome:
    """A finished plan: the result document as JSON text, and the number of its grasps."""

    result: str
    grasps: int


def warm() -> list[dict[str, Any]]:
    """Load the planner and all hands, and plan once so that the kernels are compiled.

    Returns:
        The documents of the hands.
    """
    from fingersplit.hands.hand import available_hands, load_hand
    from fingersplit.warming import compile_kernels

    hands = [load_hand(name) for name in available_hands()]
    for hand in hands:
        compile_kernels(hand)
    return [hand.to_document() for hand in hands]


def inspect_object(storage: Storage, upload: Path, unit: str) -> dict[str, Any]:
    """Check an uploaded mesh file and keep the checked mesh.

    Args:
        storage: The data directory.
        upload: The file; its suffix is its format.
        unit: Length unit of the file.

    Returns:
        What ``ObjectInfo`` says of the mesh.

    Raises:
        MeshError: The file is no graspable object.
    """
    import numpy as np

    from fingersplit.objects.intake import load_mesh

    mesh, report = load_mesh(upload, unit)
    path = storage.mesh(mesh.content_hash)
    if not path.exists():
        with storage.atomic(path) as staged:
            np.savez(staged, vertices=mesh.vertices, faces=mesh.faces)
    return {
        "id": mesh.content_hash,
        "extents": mesh.extents.tolist(),
        "volume": mesh.volume,
        "center_of_mass": mesh.center_of_mass.tolist(),
        "report": report.to_document(),
    }


def plan_job(storage: Storage, job_id: str, object_id: str, object_name: str, request: str) -> JobOutcome:
    """Plan what a job asks for, and keep the traces for its pictures.

    Args:
        storage: The data directory.
        job_id: Id of the job.
        object_id: Id of its object.
        object_name: Name of its object.
        request: The ``JobCreate`` document, JSON.
    """
    from fingersplit.hands.hand import load_hand
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
    from fingersplit.planning import plan
    from fingersplit.splitting.settings import PlannerSettings

    asked = json.loads(request)
    report_progress("preparing", 0.0)
    grasps = asked["parallel_grasps"]
    planned = plan(
        _prepared_object(storage, object_id, object_name),
        load_hand(asked["hand"]),
        None if grasps is None else [ParallelGrasp.from_document(grasp) for grasp in grasps],
        starts=asked["starts"],
        seed=asked["seed"],
        top_k=asked["top_k"],
        settings=PlannerSettings.from_document(asked["planner"]),
        progress=report_progress,
    )
    with storage.atomic(storage.traces(job_id)) as staged:
        planned.save_traces(staged)
    document = planned.to_document()
    return JobOutcome(json.dumps(document, allow_nan=False), len(document["grasps"]))


def draw_picture(storage: Storage, job_id: str, object_id: str, rank: int) -> None:
    """Draw one grasp of a job: hand and object at the start and at the end, and the quality curve."""
    from fingersplit.recording.stored import draw_stored

    with storage.atomic(storage.picture(job_id, rank)) as staged:
        draw_stored(storage.traces(job_id), _mesh(storage, object_id), rank, staged)


def _mesh(storage: Storage, object_id: str) -> "Mesh":
    import numpy as np

    from fingersplit.objects.mesh import Mesh

    with np.load(storage.mesh(object_id)) as arrays:
        return Mesh(arrays["vertices"], arrays["faces"])


@lru_cache(maxsize=_PREPARED_OBJECTS)
def _prepared_object(storage: Storage, object_id: str, object_name: str) -> "ObjectModel":
    from fingersplit.objects.model import prepare_object

    return prepare_object(_mesh(storage, object_id), object_name)


WarmTask = Callable[[], list[dict[str, Any]]]
InspectTask = Callable[[Storage, Path, str], dict[str, Any]]
PlanTask = Callable[[Storage, str, str, str, str], JobOutcome]
DrawTask = Callable[[Storage, str, str, int], None]


@dataclass(frozen=True)
class Tasks:
    """The functions that workers run."""

    warm: WarmTask = warm
    inspect: InspectTask = inspect_object
    plan: PlanTask = plan_job
    draw: DrawTask = draw_picture
