"""A scene made ready for one object and one hand: everything within reach, in the object's frame.

Obstacles stand still while a job runs, so this is done once. What the hand can never reach is left out.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import SceneError
from fingersplit.hands.hand import Hand
from fingersplit.hands.shapes_kernel import BOX, shape_distance
from fingersplit.objects.grid_kernel import build_grid
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.signed_distance_kernel import spread_samples
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.limits import build_limits
from fingersplit.scene.obstacles import HALF_SPACE, PRIMITIVE, SceneArrays
from fingersplit.scene.points_kernel import bounds_of, least_along, points_within
from fingersplit.scene.shapes import Pose
from fingersplit.scene.stable_pose import likeliest_pose, standing_pose
from fingersplit.scene.world import Obstacle, SupportSurface

__all__ = ["ObstacleMesh", "PreparedScene", "hand_reach", "prepare_scene"]

BELOW_SUPPORT = 2.0
"""[m]; what lies below a support of limited size counts as occupied down to here."""
CELL = 0.01
"""[m]; edge of the cells that sort points."""
BOUNDS_CELL, MAX_CELLS = 0.015, 400_000
"""Distance of the grid points that bound distances of points [m], and how many may be."""
BEYOND = 0.04
"""[m]; how far distances are bounded about points."""
SPREAD_ERROR = 0.5
"""[cells]; what a spread distance may be too large."""
MARGIN = 0.02
"""[m]; obstacles are kept that much beyond the hand's reach."""


@dataclass(frozen=True, eq=False)
class ObstacleMesh:
    """A mesh among the obstacles, for the exact final check.

    Attributes:
        obstacle: Its number.
        obstacle_from_object: Pose of the object in the mesh's frame, (4, 4).
        model: The mesh, prepared.
        clearance: Of all links from it [m].
    """

    obstacle: int
    obstacle_from_object: NDArray[np.float64]
    model: ObjectModel
    clearance: float


@dataclass(frozen=True, eq=False)
class PreparedScene:
    """What the search needs to know of a request's scene.

    Attributes:
        constraints: The request; its scene has an object pose if a support gives it one.
        world_from_object: Pose of the object in the scene, (4, 4).
        stable_pose_share: How likely the object rests as it was placed, 0..1; None when its pose was given.
        names: Names of supports, then of obstacles, by number.
        arrays: Obstacles within reach and contact regions for kernels; None when there are none.
        limits: ``LIMITS`` record: where the palm may be and how it may come and go.
        meshes: Those of them that are meshes.
        warnings: What a caller may not expect of the scene.
    """

    constraints: Constraints
    world_from_object: NDArray[np.float64]
    stable_pose_share: float | None
    names: tuple[str, ...]
    arrays: SceneArrays | None
    limits: np.record
    meshes: tuple[ObstacleMesh, ...]
    warnings: tuple[str, ...]

    @property
    def restricts(self) -> bool:
        """Whether anything keeps the hand from where it could be without a request."""
        scene, reach = self.constraints.scene, self.constraints.end_effector.reach
        bounded = scene.workspace is not None or reach is not None
        return self.arrays is not None or bounded or self.constraints.approach.directions is not None

    @property
    def object_from_world(self) -> NDArray[np.float64]:
        """Pose of the scene's frame in the object frame, (4, 4)."""
        return np.asarray(np.linalg.inv(self.world_from_object))


def prepare_scene(constraints: Constraints, model: ObjectModel, hand: Hand) -> PreparedScene:
    """Place the object and gather the obstacles within the hand's reach of it.

    Args:
        constraints: The request; obstacles that name an object have its model.
        model: The object to grasp.
        hand: The hand, attached bodies included.

    Raises:
        SceneError: An obstacle names an object whose model is not there, or a cloud's pose is needed.
    """
    scene, share = constraints.scene, None
    if scene.object_pose is None and scene.support_surfaces:
        resting, share = _resting(model)
        pose = scene.support_surfaces[0].scene_from_surface @ resting
        scene = replace(scene, object_pose=Pose.from_matrix(pose))
        constraints = replace(constraints, scene=scene)
    world_from_object = scene.world_from_object
    gatherer = _Gatherer(constraints, model, hand, np.asarray(np.linalg.inv(world_from_object)))
    for surface in scene.support_surfaces:
        gatherer.add_support(surface)
    for number, obstacle in enumerate(scene.obstacles):
        gatherer.add_obstacle(number, obstacle)
    names = [surface.id for surface in scene.support_surfaces] + [obstacle.id for obstacle in scene.obstacles]
    return PreparedScene(
        constraints,
        world_from_object,
        share,
        tuple(names),
        gatherer.arrays(),
        build_limits(constraints, world_from_object, hand),
        tuple(gatherer.meshes),
        tuple(gatherer.warnings),
    )


def _resting(model: ObjectModel) -> tuple[NDArray[np.float64], float | None]:
    """How an object without a pose rests on a support, and how likely; as its cloud stood, where that is known."""
    standing = standing_pose(model)
    if standing is not None:
        return standing, None
    if model.one_sided:
        raise SceneError(
            "scene.object_pose",
            "is needed: the object is a point cloud that shows one side, from which its stable poses cannot be told. "
            "Give its pose, or the plane that it stands on (support).",
        )
    return likeliest_pose(model)


def hand_reach(hand: Hand) -> float:
    """Farthest that any point of the hand can be from the palm's origin [m], whatever the joints."""
    arrays, reach = hand.arrays, 0.0
    for shape in range(arrays.shape_count):
        finger, link = int(arrays.shape_fingers[shape]), int(arrays.shape_links[shape])
        chain = 0.0 if finger < 0 else float(np.linalg.norm(arrays.positions[finger, : link + 1], axis=1).sum())
        own = float(np.linalg.norm(arrays.shape_positions[shape]) + arrays.shape_radii[shape])
        reach = max(reach, chain + own)
    return reach


class _Gatherer:
    """Collects what stands within reach."""

    def __init__(
        self, constraints: Constraints, model: ObjectModel, hand: Hand, object_from_world: NDArray[np.float64]
    ) -> None:
        scene, approach = constraints.scene, constraints.approach
        self._clearance, self._object_from_world, self._model = scene.clearance, object_from_world, model
        self._supports, self._regions = len(scene.support_surfaces), constraints.contact_regions
        self._hand_reach = hand_reach(hand)
        self._center = model.mesh.bounds.mean(axis=0)
        way = max(approach.desired_distance, approach.retreat.desired_distance)
        half = float(np.linalg.norm(model.mesh.extents)) / 2
        self._reach = half + 2.0 * self._hand_reach + way + MARGIN
        self._primitives: list[tuple[int, int, NDArray[np.float64], NDArray[np.float64], float]] = []
        self._points: list[NDArray[np.float64]] = []
        self._owners: list[NDArray[np.int32]] = []
        self._inflations: list[NDArray[np.float64]] = []
        self.meshes: list[ObstacleMesh] = []
        self.warnings: list[str] = []

    def add_support(self, surface: SupportSurface) -> None:
        """A plane, or a deep box under a plane of limited size."""
        number = len(self._primitives)
        pose = self._object_from_world @ surface.scene_from_surface
        pad_clearance = 0.0 if surface.allow_finger_contact else self._clearance
        normal = np.ascontiguousarray(pose[:3, 2])
        lowest = float(least_along(self._model.mesh.vertices, normal) - pose[:3, 3] @ normal)
        if lowest < -2e-3:
            self.warnings.append(
                f"The object reaches {-1e3 * lowest:.0f} mm below support surface {surface.id!r}; "
                f"check scene.object_pose."
            )
        if surface.extents is None:
            self._primitives.append((HALF_SPACE, number, np.zeros(3), pose, pad_clearance))
            return
        half = np.array([*surface.extents, BELOW_SUPPORT]) / 2
        pose[:3, 3] -= half[2] * pose[:3, 2]
        self._primitives.append((BOX, number, half, pose, pad_clearance))

    def add_obstacle(self, index: int, obstacle: Obstacle) -> None:
        """A primitive, a mesh or a cloud; left out when it is out of reach."""
        number, pose = self._supports + index, self._object_from_world @ obstacle.pose.matrix
        if obstacle.primitive is not None:
            kind, size = obstacle.primitive.kind, obstacle.primitive.half_sizes
            local = (self._center - pose[:3, 3]) @ pose[:3, :3]
            if shape_distance(kind, size, *local.tolist()) <= self._reach:
                self._primitives.append((kind, number, size, pose, self._clearance))
        elif obstacle.points is not None:
            self._add_points(number, pose, obstacle.points, obstacle.point_radius)
        elif obstacle.model is None:
            raise SceneError(
                f"scene.obstacles[{index}].object_id", f"{obstacle.object_id!r} names an object that was not loaded."
            )
        else:
            self._add_model(obstacle, number, pose, obstacle.model)

    def _add_model(self, obstacle: Obstacle, number: int, pose: NDArray[np.float64], model: ObjectModel) -> None:
        points = model.surface.grid.points if model.seen + model.assumed >= 1.0 - 1e-9 else model.collision.points
        if self._add_points(number, pose, points, obstacle.point_radius):
            clearance = self._clearance + obstacle.point_radius
            self.meshes.append(ObstacleMesh(number, np.asarray(np.linalg.inv(pose)), model, clearance))

    def _add_points(self, number: int, pose: NDArray[np.float64], points: NDArray[np.float64], radius: float) -> bool:
        """Keep the points within reach; whether there are any."""
        kept = points_within(points, pose, self._center, self._reach + radius)
        if not len(kept):
            return False
        self._points.append(kept)
        self._owners.append(np.full(len(kept), number, np.int32))
        self._inflations.append(np.full(len(kept), radius + self._clearance))
        return True

    def arrays(self) -> SceneArrays | None:
        """What was gathered; None when that is nothing and contacts may be everywhere."""
        if not self._primitives and not self._points and self._regions.unbounded:
            return None
        admitted = self._regions.admit(self._model.surface.grid.points, self._model)
        primitives = np.rec.array(np.zeros(len(self._primitives), PRIMITIVE))
        planes_first = sorted(self._primitives, key=lambda primitive: primitive[0] != HALF_SPACE)
        for record, (kind, number, size, pose, pad_clearance) in zip(primitives, planes_first, strict=True):
            record.kind, record.obstacle, record.size, record.pad_clearance = kind, number, size, pad_clearance
            record.rotation, record.position, record.clearance = pose[:3, :3], pose[:3, 3], self._clearance
        planes = sum(primitive[0] == HALF_SPACE for primitive in self._primitives)
        if not self._points:
            empty, order = build_grid(np.zeros((1, 3)), CELL)
            none = np.zeros(0)
            return SceneArrays(
                primitives,
                planes,
                empty,
                order[:0].astype(np.int32),
                none,
                np.zeros((1, 1, 1), np.float32),
                (0.0, 0.0, 0.0),
                1.0,
                0.0,
                0.0,
                self._hand_reach,
                admitted,
            )
        points = np.concatenate(self._points)
        grid, order = build_grid(points, CELL)
        bounds, origin, cell = _distance_bounds(grid.points, BOUNDS_CELL)
        inflations = np.concatenate(self._inflations)[order]
        return SceneArrays(
            primitives,
            planes,
            grid,
            np.concatenate(self._owners)[order],
            inflations,
            bounds,
            origin,
            cell,
            BEYOND,
            float(inflations.max()),
            self._hand_reach,
            admitted,
        )


def _distance_bounds(
    points: NDArray[np.float64], cell: float
) -> tuple[NDArray[np.float32], tuple[float, float, float], float]:
    """For every point of a grid about ``points`` a distance that none of them is nearer.

    Returns:
        The distances (nx, ny, nz) [m], the place of the first grid point [m] and the distance of neighbours [m].
    """
    low, high = bounds_of(points) + np.array([[-BEYOND], [BEYOND]])
    cell = max(cell, float(np.prod(high - low) / MAX_CELLS) ** (1 / 3))
    shape = np.ceil((high - low) / cell).astype(np.int64) + 1
    nearest, squares = np.full(shape, -1, np.int32), np.full(shape, np.inf, np.float32)
    x, y, z = low.tolist()
    spread_samples(points, (x, y, z), cell, nearest, squares)
    bounds = np.maximum(np.sqrt(squares) - np.float32(SPREAD_ERROR * cell), np.float32(0.0))
    return bounds, (x, y, z), cell
