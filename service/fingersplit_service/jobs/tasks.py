"""What worker processes do: look at an upload, find parallel grasps, plan, draw.

The planner is imported inside the functions, so that only workers load it: the service process stays small
and starts fast. What goes in and comes out is plain and small; meshes and traces travel as files.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingersplit_service.findings import Finding
from fingersplit_service.jobs.stored_objects import convex_pieces, keep_object, planner_settings, prepared_object
from fingersplit_service.jobs.views import DrawTask, ExportedFile, best_rank, convert_result, draw_view
from fingersplit_service.jobs.worker import report_progress
from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.plan import Plan

__all__ = [
    "ConvertTask",
    "DecomposeTask",
    "DrawTask",
    "ExportTask",
    "GenerateTask",
    "InspectTask",
    "JobOrder",
    "JobOutcome",
    "PlanTask",
    "Tasks",
    "Upload",
    "WarmTask",
    "Warmth",
    "decompose_object",
    "export_mesh",
    "generate_parallel_grasps",
    "inspect_object",
    "keep_recording",
    "plan_job",
    "verify_plan",
    "warm",
]

_SHARE_OF_DEADLINE = 0.8  # after which nothing more is verified, so that the worker is not killed with its results


@dataclass(frozen=True)
class Warmth:
    """What a warm worker says: the documents of the hands, and whether it had to compile kernels."""

    hands: list[dict[str, Any]]
    compiled: bool = False


@dataclass(frozen=True)
class Upload:
    """An uploaded file for a worker to check.

    Attributes:
        path: The file; its suffix is its format.
        unit: Length unit of the file.
        options: ``ObjectOptions`` document.
        viewpoint: Where the camera of a point cloud stood, in the file's frame and unit.
    """

    path: Path
    unit: str
    options: dict[str, Any]
    viewpoint: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class JobOrder:
    """A job for a worker: its object, the ``JobCreate`` document, and when the worker will be killed [s]."""

    job_id: str
    object_id: str
    object_name: str
    request: str
    deadline_s: float


@dataclass(frozen=True)
class JobOutcome:
    """A finished job.

    Attributes:
        finding: What to keep.
        stage_ms: Time by stage [ms], for the metrics.
        simulated: Whether each simulation held, for the metrics.
        pictured: Rank of the grasp whose picture stands for the run; None when there can be none.
    """

    finding: Finding
    stage_ms: dict[str, float] = field(default_factory=dict)
    simulated: tuple[bool, ...] = ()
    pictured: int | None = None


def warm() -> Warmth:
    """Load the planner and all hands, and plan once so that the kernels are compiled."""
    from fingersplit.hands.hand import available_hands, load_hand
    from fingersplit.warming import compile_kernels

    hands = [load_hand(name) for name in available_hands()]
    for hand in hands:
        compile_kernels(hand)
    return Warmth([hand.to_document() for hand in hands], _has_compiled())


def _has_compiled() -> bool:
    """Whether a kernel of the planner was not in the cache and had to be compiled in this process."""
    from numba.core.dispatcher import Dispatcher

    planner = [module for name, module in sys.modules.items() if name.startswith("fingersplit.")]
    kernels = [value for module in planner for value in vars(module).values() if isinstance(value, Dispatcher)]
    return any(kernel.stats.cache_misses for kernel in kernels)


def inspect_object(storage: Storage, upload: Upload) -> dict[str, Any]:
    """Check an uploaded file, and keep and prepare the mesh or point cloud in it.

    Returns:
        What ``ObjectInfo`` says of the object.

    Raises:
        MeshError: The file is no graspable object.
    """
    from fingersplit.objects.intake import load_object
    from fingersplit.objects.options import ObjectOptions

    options = ObjectOptions.from_document(upload.options)
    shape, report = load_object(upload.path, upload.unit, upload.viewpoint)
    object_id, model = keep_object(storage, shape, options)
    return {
        "id": object_id,
        "extents": model.mesh.extents.tolist(),
        "volume": model.mass_properties.volume,
        "center_of_mass": model.center_of_mass.tolist(),
        "options": options.to_document(),
        "report": report.to_document(),
    }


def decompose_object(storage: Storage, object_id: str) -> None:
    """Compute an object's convex pieces before a job needs them, unless it was deleted meanwhile."""
    if storage.shape(object_id).exists():
        convex_pieces(storage, object_id)
    if not storage.shape(object_id).exists():
        storage.remove_object(object_id)


def generate_parallel_grasps(storage: Storage, object_id: str, asked: dict[str, Any]) -> list[dict[str, Any]]:
    """Find parallel grasps of an object that fit a hand's opening, as a ``ParallelGraspsGenerate`` document says."""
    import numpy as np

    from fingersplit.hands.hand import load_hand
    from fingersplit.parallel_grasps.sources import find_parallel_grasps

    grasps = find_parallel_grasps(
        prepared_object(storage, object_id, object_id),
        2 * asked["count"],  # a pair is two starts, one for either assignment of the fingers
        source=asked["source"],
        friction=asked["friction"],
        opening=load_hand(asked["hand"]).gripper.opening,
        rng=np.random.default_rng(asked["seed"]),
    )
    return [grasp.to_document() for grasp in grasps]


def plan_job(storage: Storage, order: JobOrder) -> JobOutcome:
    """Plan what a job asks for, verify what it wants verified, and keep the traces for its pictures."""
    from fingersplit.hands.hand import load_hand
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
    from fingersplit.planning import plan

    asked = json.loads(order.request)
    time_to_verify = time.monotonic() + _SHARE_OF_DEADLINE * order.deadline_s
    report_progress("preparing", 0.0)
    model = prepared_object(storage, order.object_id, order.object_name)
    settings = planner_settings(model, asked["planner"])
    grasps = asked["parallel_grasps"]
    planned = plan(
        model,
        load_hand(asked["hand"]),
        None if grasps is None else [ParallelGrasp.from_document(grasp) for grasp in grasps],
        source=asked.get("source", "antipodal"),  # which jobs that an older version queued do not name
        starts=asked["starts"],
        seed=asked["seed"],
        top_k=asked["top_k"],
        settings=settings,
        progress=report_progress,
    )
    if asked["verified"]:
        planned = verify_plan(storage, order.object_id, planned, asked, time_to_verify)
    document = planned.to_document()
    result = json.dumps(document, allow_nan=False, separators=(",", ":"))
    warnings = keep_recording(storage, order.job_id, planned, result) if asked["recording"] else []
    ranked = document["grasps"]
    simulated = tuple(grasp["verification"]["passed"] for grasp in ranked if grasp["verification"])
    finding = Finding(
        result=result,
        grasps=len(ranked),
        feasible=document["summary"]["feasible"],
        verified=sum(simulated),
        holding_margin=ranked[0]["metrics"]["holding_margin"] if ranked else None,
        warnings=warnings,
    )
    pictured = best_rank(ranked) if asked["recording"] and not warnings else None
    return JobOutcome(finding, document["timings_ms"], simulated, pictured)


def verify_plan(storage: Storage, object_id: str, planned: "Plan", asked: dict[str, Any], until: float) -> "Plan":
    """Simulate ranked grasps until as many have held as the job asks for, or the monotonic clock says ``until``."""
    from fingersplit.proving import prove

    report_progress("convex_pieces", 0.0)
    pieces = convex_pieces(storage, object_id)
    report_progress("verifying", 0.0)
    return prove(
        planned,
        pieces,
        verified=asked["verified"],
        protocol=asked["protocol"],
        controller=asked["controller"],
        friction=asked.get("simulated_friction"),  # which jobs that an older version queued do not name
        deadline=max(0.0, until - time.monotonic()),
        initial=asked["verify_initial"],
    )


def keep_recording(storage: Storage, job_id: str, planned: "Plan", result: str) -> list[str]:
    """Write what pictures of the grasps need; what went wrong, in sentences, where that cannot be."""
    from fingersplit.recording.traces_file import save_traces

    try:
        with storage.atomic(storage.traces(job_id), durable=False) as staged:
            save_traces(planned, result, staged)
    except OSError as error:
        return [f"What pictures and recordings need could not be written: {error.strerror}."]
    return []


def export_mesh(storage: Storage, object_id: str, file_type: str) -> None:
    """Write an object's prepared mesh, in metres, as a file of a common format."""
    with storage.atomic(storage.mesh_export(object_id, file_type)) as staged:
        prepared_object(storage, object_id, object_id).mesh.trimesh.export(staged, file_type=file_type)


WarmTask = Callable[[], Warmth]
InspectTask = Callable[[Storage, Upload], dict[str, Any]]
DecomposeTask = Callable[[Storage, str], None]
GenerateTask = Callable[[Storage, str, dict[str, Any]], list[dict[str, Any]]]
PlanTask = Callable[[Storage, JobOrder], JobOutcome]
ConvertTask = Callable[[str, str, int | None], ExportedFile]
ExportTask = Callable[[Storage, str, str], None]


@dataclass(frozen=True)
class Tasks:
    """The functions that workers run."""

    warm: WarmTask = warm
    inspect: InspectTask = inspect_object
    decompose: DecomposeTask = decompose_object
    generate: GenerateTask = generate_parallel_grasps
    plan: PlanTask = plan_job
    draw: DrawTask = draw_view
    export: ExportTask = export_mesh
    convert: ConvertTask = convert_result
