"""What workers do with objects: check and prepare an upload, cut a view, decompose, export."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingersplit_client.schemas import Unit
from fingersplit_service.jobs.stored_objects import convex_pieces, keep_object, prepared_object
from fingersplit_service.storage import Storage

__all__ = ["Upload", "ViewUpload", "cut_view", "decompose_object", "export_mesh", "inspect_object"]


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


def export_mesh(storage: Storage, object_id: str, file_type: str) -> None:
    """Write an object's prepared mesh, in metres, as a file of a common format."""
    with storage.atomic(storage.mesh_export(object_id, file_type)) as staged:
        prepared_object(storage, object_id, object_id).mesh.trimesh.export(staged, file_type=file_type)
