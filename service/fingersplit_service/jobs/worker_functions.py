"""What worker processes do: inspect an upload, find parallel grasps, plan, render.

The planner is imported inside the functions, so that only workers load it: the service process stays small
and starts fast. What goes in and comes out is plain and small; meshes and traces travel as files.
"""

import gc
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fingersplit_client.schemas import ParallelGraspsGenerate, Unit
from fingersplit_service.jobs.dataset_shards import ShardTask, write_shard_of
from fingersplit_service.jobs.hand_work import HandTask, HandUpload, add_hand, correct_hand, stored_hand, view_hand
from fingersplit_service.jobs.outcome import JobOutcome
from fingersplit_service.jobs.planning import PlanTask, draw_starts, plan_job
from fingersplit_service.jobs.rendering import ExportedFile, RenderTask, convert_result, render_view
from fingersplit_service.jobs.stored_objects import convex_pieces, keep_object, prepared_object
from fingersplit_service.jobs.verifying import VerifiedResult, VerifyTask, verify_first
from fingersplit_service.storage import Storage

__all__ = [
    "GraspFile",
    "Upload",
    "ViewUpload",
    "WarmUpReport",
    "WorkerFunctions",
    "check_touching",
    "cut_view",
    "decompose_object",
    "export_mesh",
    "generate_parallel_grasps",
    "import_grasps",
    "inspect_object",
    "warm",
]

_MAX_GRASPS = 1024  # of one set


@dataclass(frozen=True)
class WarmUpReport:
    """What a warm worker knows.

    Attributes:
        hands: The documents of the hands.
        compiled: Whether it had to compile kernels.
        catalogs: What the planner's registries hold, documents by ``metrics``, ``formats`` and ``sources``.
    """

    hands: list[dict[str, Any]]
    compiled: bool = False
    catalogs: dict[str, list[dict[str, Any]]] = field(default_factory=dict)


@dataclass(frozen=True)
class Upload:
    """An uploaded file for a worker to check.

    Attributes:
        path: The file; its suffix is its format.
        unit: Length unit of the file.
        options: ``ObjectOptions`` document.
        viewpoint: Where the camera of a point cloud stood, in the file's frame and unit.
        scale: Multiplies the file's numbers besides.
        support: Plane that the object of a point cloud stands on: normal, and offset in the file's unit.
    """

    path: Path
    unit: Unit
    options: dict[str, Any]
    viewpoint: tuple[float, float, float] | None = None
    scale: float = 1.0
    support: tuple[float, float, float, float] | None = None


@dataclass(frozen=True)
class ViewUpload:
    """An uploaded depth image or organised cloud for a worker to cut into a target and a scene.

    Attributes:
        path: The file, ``.npz`` or ``.png``.
        mask: Image of the object's pixels; None where the file has it.
        intrinsics: fx, fy, cx, cy [pixels]; None where the file has them.
        depth_scale: Metres of one unit of depth; None for what the file says.
        camera_pose: Position [m] and quaternion wxyz, world_from_camera; None for what the file says.
        frame: Frame of the scene, ``world`` or ``camera``.
        support: Whether the support surface is to be found.
        clearance: Of the hand from obstacles and support [m].
        complete: Whether the target's unseen side is assumed where the support is known.
        options: ``ObjectOptions`` document of the target.
    """

    path: Path
    mask: Path | None
    intrinsics: tuple[float, ...] | None
    depth_scale: float | None
    camera_pose: tuple[float, ...] | None
    frame: str
    support: bool
    clearance: float
    complete: bool
    options: dict[str, Any]


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


def warm() -> WarmUpReport:
    """Load the planner and all hands, and plan once so that the kernels are compiled."""
    from fingersplit.cli.warming import compile_kernels
    from fingersplit.hands.hand import available_hands, load_hand

    hands = [load_hand(name) for name in available_hands()]
    compile_kernels(hands)
    gc.freeze()  # going through all that was loaded would take 0.2 s, in the middle of a job
    return WarmUpReport([hand.to_document() for hand in hands], _has_compiled(), _catalogs())


def _catalogs() -> dict[str, list[dict[str, Any]]]:
    from fingersplit.contacts.metrics import available_metrics
    from fingersplit.formats import available_formats
    from fingersplit.parallel_grasps.sources import available_sources
    from fingersplit.verification.controllers import available_controllers
    from fingersplit.verification.protocols import available_protocols

    sources = available_sources().values()
    return {
        "metrics": [metric.to_document() for metric in available_metrics().values()],
        "formats": [one.to_document() for one in available_formats().values()],
        "sources": [{"name": source.name, "meaning": source.meaning} for source in sources],
        "protocols": [protocol.info() for protocol in available_protocols().values()],
        "controllers": [controller.info() for controller in available_controllers().values()],
    }


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
        ObjectFileError: The file is no graspable object.
    """
    from fingersplit.errors import ObjectFileError
    from fingersplit.objects.intake import read_file
    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.source import ObjectSource

    options = ObjectOptions.from_document(upload.options)
    source = ObjectSource(upload.unit, upload.scale, upload.viewpoint, upload.support)
    shape, report = read_file(upload.path, source)
    if upload.support is not None and isinstance(shape, Mesh):
        raise ObjectFileError("needless_support", "A support belongs to a point cloud, but the file holds a mesh.")
    model = keep_object(storage, shape, options, source, report)
    return {
        "id": model.id,
        "extents": model.mesh.extents.tolist(),
        "volume": model.mass_properties.volume,
        "center_of_mass": model.center_of_mass.tolist(),
        "options": options.to_document(),
        "report": report.to_document(),
    }


def cut_view(storage: Storage, view: ViewUpload) -> tuple[dict[str, Any], dict[str, Any]]:
    """Cut a view into its target, which is kept and prepared, and the scene around it.

    Returns:
        What ``ObjectInfo`` says of the target, and what ``ViewedScene`` says beside it.

    Raises:
        SceneError: The view cannot be used.
        ObjectFileError: The target is no graspable object.
    """
    import numpy as np

    from fingersplit.scene.from_view import scene_from_view
    from fingersplit.scene.shapes import Pose
    from fingersplit.scene.view_files import read_view

    pose = view.camera_pose
    seen = read_view(
        view.path,
        view.mask,
        intrinsics=view.intrinsics,
        depth_scale=view.depth_scale,
        world_from_camera=None if pose is None else Pose.from_numbers(pose).matrix,
    )
    found = scene_from_view(
        seen, frame=view.frame, support=view.support, clearance=view.clearance, complete=view.complete
    )
    target = storage.staged(".npz")
    try:
        np.savez(target, **found.target.to_arrays())
        described = inspect_object(storage, Upload(target, "m", view.options))
    finally:
        target.unlink(missing_ok=True)
    return described, {
        "scene": found.scene.to_document(),
        "target_points": len(found.target.points),
        "obstacle_points": found.obstacle_points,
        "support_points": found.support_points,
        "warnings": list(found.warnings),
    }


def decompose_object(storage: Storage, object_id: str) -> None:
    """Compute an object's convex pieces before a job needs them, unless it was deleted meanwhile."""
    shape = storage.shape(object_id)
    if storage.exists(shape):
        convex_pieces(storage, object_id)
    if not storage.exists(shape):
        storage.remove_object(object_id)


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


def export_mesh(storage: Storage, object_id: str, file_type: str) -> None:
    """Write an object's prepared mesh, in metres, as a file of a common format."""
    with storage.atomic(storage.mesh_export(object_id, file_type)) as staged:
        prepared_object(storage, object_id, object_id).mesh.trimesh.export(staged, file_type=file_type)


@dataclass(frozen=True)
class WorkerFunctions:
    """The functions that workers run; a test may put others in their place."""

    warm: Callable[[], WarmUpReport] = warm
    inspect: Callable[[Storage, Upload], dict[str, Any]] = inspect_object
    cut_view: Callable[[Storage, ViewUpload], tuple[dict[str, Any], dict[str, Any]]] = cut_view
    decompose: Callable[[Storage, str], None] = decompose_object
    generate: Callable[[Storage, str, ParallelGraspsGenerate], list[dict[str, Any]]] = generate_parallel_grasps
    check_touching: Callable[[Storage, str, list[dict[str, Any]]], None] = check_touching
    import_grasps: Callable[[Storage, str, str, GraspFile], tuple[list[dict[str, Any]], str]] = import_grasps
    plan: Callable[[Storage, PlanTask], JobOutcome] = plan_job
    verify: Callable[[Storage, VerifyTask], VerifiedResult] = verify_first
    render: Callable[[Storage, RenderTask], None] = render_view
    draw_starts: Callable[[Storage, PlanTask], None] = draw_starts
    export: Callable[[Storage, str, str], None] = export_mesh
    write_shard: Callable[[Storage, ShardTask], None] = write_shard_of
    convert: Callable[[Storage, str, str, int | None], ExportedFile] = convert_result
    add_hand: Callable[[Storage, HandUpload], dict[str, Any]] = add_hand
    correct_hand: Callable[[Storage, str, str], dict[str, Any]] = correct_hand
    view_hand: Callable[[Storage, HandTask], None] = view_hand
