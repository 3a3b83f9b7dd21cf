"""What stands around the object as something to draw: supports, obstacles, forbidden surface, the way in and out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.objects.model import ObjectModel
from fingersplit.result.grasp import GraspResult
from fingersplit.scene.preparing import PreparedScene
from fingersplit.scene.shapes import Primitive
from fingersplit.scene.world import Obstacle, SupportSurface
from fingersplit.transforms import transform_points

__all__ = ["Surrounding", "find_surroundings", "path_of"]

BESIDE = 0.25
"""[m]; how far an endless support is drawn beyond the object."""
THICKNESS = 0.004
"""[m]; of a support as it is drawn."""
POINTS = 4_000
"""Most that are drawn of a cloud."""
OFF_SURFACE = 4e-4
"""[m]; how far forbidden surface is drawn off the object, to be seen on it."""

Kind = Literal["support", "obstacle", "cloud", "forbidden"]


@dataclass(frozen=True, eq=False)
class Surrounding:
    """One thing around the object, object frame.

    Attributes:
        name: As the request calls it.
        kind: What it is.
        vertices: Corners of its triangles, or its points, (n, 3) [m].
        faces: Triangles (m, 3); none of a cloud.
        rejected: Candidate grasps that it rejected.
    """

    name: str
    kind: Kind
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    rejected: int

    @property
    def label(self) -> str:
        """Its name, and what it rejected."""
        return f"{self.name}: {self.rejected} rejected" if self.rejected else self.name


def find_surroundings(
    scene: PreparedScene, model: ObjectModel, rejected_by: Mapping[str, int]
) -> tuple[Surrounding, ...]:
    """Everything to draw around an object.

    Args:
        scene: The scene, prepared for it.
        model: The object.
        rejected_by: Candidates that each obstacle rejected, as a result states them.
    """
    world, found = scene.constraints.scene, list[Surrounding]()
    for surface in world.support_surfaces:
        plate = _plate(surface, scene, model)
        found.append(_of_mesh(surface.id, "support", plate, np.eye(4), rejected_by))
    for obstacle in world.obstacles:
        found.append(_obstacle(obstacle, scene.object_from_world @ obstacle.pose.matrix, rejected_by))
    regions = scene.constraints.contact_regions
    if not regions.unbounded:
        mesh = model.mesh
        refused = ~regions.admit(mesh.vertices[mesh.faces].mean(axis=1), model)
        if refused.any():
            raised = mesh.vertices + OFF_SURFACE * np.asarray(mesh.trimesh.vertex_normals)
            faces = np.asarray(mesh.faces[refused], np.int64)
            found.append(Surrounding("contact regions", "forbidden", raised, faces, 0))
    return tuple(found)


def path_of(grasp: GraspResult) -> NDArray[np.float64]:
    """Where the palm's origin travels: start of the approach, grasp, end of the retreat, (2 or 3, 3) [m]."""
    palm = grasp.palm.object_from_palm[:3, 3]
    places = [palm]
    if grasp.pregrasp is not None:
        places.insert(0, grasp.pregrasp.palm.object_from_palm[:3, 3])
    if grasp.retreat_path is not None:
        places.append(palm + grasp.retreat_path.distance * np.array(grasp.retreat_path.direction))
    return np.array(places)


def _obstacle(obstacle: Obstacle, pose: NDArray[np.float64], rejected_by: Mapping[str, int]) -> Surrounding:
    if obstacle.primitive is not None:
        return _of_mesh(obstacle.id, "obstacle", _solid(obstacle.primitive), pose, rejected_by)
    if obstacle.model is not None:
        mesh = obstacle.model.mesh
        return _of_mesh(obstacle.id, "obstacle", trimesh.Trimesh(mesh.vertices, mesh.faces), pose, rejected_by)
    points = np.empty((0, 3)) if obstacle.points is None else obstacle.points
    shown = points[np.unique(np.linspace(0, len(points) - 1, min(len(points), POINTS)).round().astype(np.int64))]
    placed = transform_points(pose, shown)
    return Surrounding(obstacle.id, "cloud", placed, np.empty((0, 3), np.int64), rejected_by.get(obstacle.id, 0))


def _of_mesh(
    name: str, kind: Kind, mesh: trimesh.Trimesh, pose: NDArray[np.float64], rejected_by: Mapping[str, int]
) -> Surrounding:
    vertices, faces = transform_points(pose, np.asarray(mesh.vertices)), np.asarray(mesh.faces, np.int64)
    return Surrounding(name, kind, vertices, faces, rejected_by.get(name, 0))


def _solid(primitive: Primitive) -> trimesh.Trimesh:
    sizes = primitive.dimensions
    makers: dict[str, Any] = {
        "box": lambda: trimesh.creation.box(sizes),
        "sphere": lambda: trimesh.creation.icosphere(subdivisions=3, radius=sizes[0]),
        "cylinder": lambda: trimesh.creation.cylinder(height=sizes[0], radius=sizes[1], sections=48),
        "capsule": lambda: trimesh.creation.capsule(height=sizes[0], radius=sizes[1]),
    }
    mesh: trimesh.Trimesh = makers[primitive.type]()
    if primitive.type == "capsule":
        mesh.apply_translation(-mesh.bounds.mean(axis=0))  # some versions of the library begin at the lower end
    return mesh


def _plate(surface: SupportSurface, scene: PreparedScene, model: ObjectModel) -> trimesh.Trimesh:
    """A thin box below a support surface, in the object frame; of an endless one the part below the object."""
    pose = scene.object_from_world @ surface.scene_from_surface
    if surface.extents is not None:
        x, y, middle = *surface.extents, np.zeros(2)
    else:
        flat = (model.mesh.vertices - pose[:3, 3]) @ pose[:3, :2]
        middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
        x, y = (np.ptp(flat, axis=0) + 2 * BESIDE).tolist()
    plate = trimesh.creation.box((x, y, THICKNESS))
    plate.apply_translation((*middle, -THICKNESS / 2))
    plate.apply_transform(pose)
    return plate
