"""A view becomes a target and what stands around it: the object's cloud, an obstacle cloud, the support surface."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from fingersplit.errors import SceneError
from fingersplit.extras import extra
from fingersplit.objects.cloud import MIN_POINTS, PointCloud
from fingersplit.objects.grid_kernel import thin_evenly
from fingersplit.scene.shapes import Pose
from fingersplit.scene.view import View
from fingersplit.scene.world import GRAVITY, Obstacle, Scene, SupportSurface

__all__ = ["ViewedScene", "scene_from_view"]

SPACING = 4e-3
"""[m]; obstacle points are thinned to this, and each is a ball of this radius, which covers those left out."""
BESIDE_TARGET = 2
"""Pixels about the target's that show a mixture of it and what is behind."""
ON_PLANE = 5e-3
"""[m]; points nearer than this to the support surface are part of it."""
TRIALS, FITTED, PLANES = 200, 4_000, 3
"""RANSAC's trials and points, and how many planes are looked at."""
MIN_SHARE = 0.1
"""Of the points around the target, what a support surface must have."""
CONTACT_GAP = 0.03
"""[m]; so near to it must the target come, since it stands on it."""
MIN_UPRIGHTNESS = np.cos(np.radians(45.0))
STEEP = np.cos(np.radians(35.0))
"""A view along the support's normal, nearly: it does not see how the target comes near the support."""


@dataclass(frozen=True, eq=False)
class ViewedScene:
    """What a view holds.

    Attributes:
        target: Points of the object, in the camera's frame, which is the object's frame; seen from its origin.
        scene: What stands around it: the object's pose, gravity, support surface, obstacle cloud.
        support_points: Points in which the support surface was found; 0 if none was asked for.
        obstacle_points: Points of the obstacle cloud.
        warnings: What a caller may not expect.
    """

    target: PointCloud
    scene: Scene
    support_points: int
    obstacle_points: int
    warnings: tuple[str, ...]


def scene_from_view(
    view: View,
    *,
    frame: str = "world",
    support: bool = False,
    clearance: float = 0.002,
    reach: float = 0.5,
    complete: bool = True,
) -> ViewedScene:
    """Cut a view into the object to grasp and its surroundings.

    Args:
        view: Image and mask.
        frame: Frame of the scene, and so of the answer: ``world``, for which the camera's pose must be known, or
            ``camera``.
        support: Whether the object stands on a plane that is to be found (RANSAC, [Fischler1981]).
        clearance: Of the hand from obstacles and support [m].
        reach: Obstacles are kept this far from the target's middle [m].
        complete: Whether the target's other side is assumed where the support is known, so that contacts may lie on it.

    Raises:
        SceneError: Too few pixels of the object, an unknown frame, no pose for the world, or no support surface.
    """
    if frame not in ("world", "camera"):
        raise SceneError("frame", f"is {frame!r}; known: world, camera.")
    if frame == "world" and view.world_from_camera is None:
        raise SceneError("camera_pose", 'is needed for the frame "world"; or ask for the frame "camera".')
    measured = np.isfinite(view.points).all(axis=2)
    target = view.points[measured & view.mask]
    if len(target) < MIN_POINTS:
        raise SceneError(
            "mask", f"has {len(target):,} measured pixels of the object; at least {MIN_POINTS} are needed."
        )
    around = view.points[measured & ~binary_dilation(view.mask, iterations=BESIDE_TARGET)]
    around = around[np.linalg.norm(around - np.median(target, axis=0), axis=1) <= reach]
    scene_from_camera = np.eye(4) if frame == "camera" or view.world_from_camera is None else view.world_from_camera
    plane, warnings, found = None, list[str](), 0
    if support:
        plane, on_it = _find_support(around, target, view.world_from_camera)
        if float(np.quantile(target @ plane.normal - plane.offset, 0.02)) > CONTACT_GAP:
            warnings.append("The target is taken to stand on the support; seen from above, its lower part is not seen.")
        found, around = int(on_it.sum()), around[around @ plane.normal - plane.offset > ON_PLANE]
    kept = _thinned(around)
    gravity, told = _gravity(view, frame, plane)
    warnings += told
    scene = Scene(
        frame=frame,
        object_pose=Pose.from_matrix(scene_from_camera),
        gravity=gravity,
        support_surfaces=() if plane is None else (plane.surface(scene_from_camera),),
        obstacles=(
            Obstacle(
                "seen by the camera",
                Pose.from_matrix(scene_from_camera),
                points=np.round(kept, 4),
                point_radius=SPACING + 1e-4,  # and what rounding moved
            ),
        )
        if len(kept)
        else (),
        clearance=clearance,
    )
    known = None if plane is None or not complete else np.append(plane.normal, plane.offset)
    return ViewedScene(
        PointCloud(target, viewpoint=np.zeros(3), support=known), scene, found, len(kept), tuple(warnings)
    )


def _thinned(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Some of the points (n, 3) so that every other one is within ``SPACING`` of one of them."""
    if not len(points):
        return points
    mixed = np.random.default_rng(0).permutation(points)
    return np.asarray(mixed[thin_evenly(mixed, SPACING)])


def _gravity(view: View, frame: str, plane: "_Plane | None") -> tuple[tuple[float, float, float], list[str]]:
    """Gravity in the scene's frame, and what is to be said of it."""
    if frame == "world":
        return GRAVITY, []
    if view.world_from_camera is not None:
        x, y, z = (view.world_from_camera[:3, :3].T @ GRAVITY).tolist()
        return (x, y, z), []
    strength = float(np.linalg.norm(GRAVITY))
    if plane is not None:
        x, y, z = (-strength * plane.normal).tolist()
        return (x, y, z), ["Gravity is taken to point into the support surface, since the camera's pose is not known."]
    return (0.0, strength, 0.0), [
        "Gravity is taken to point down in the image, since neither the camera's pose nor a support surface is known."
    ]


class _Plane:
    """A plane as scikit-image's RANSAC fits it: normal . p = offset."""

    def __init__(self, normal: NDArray[np.float64], offset: float) -> None:
        self.normal, self.offset = normal, offset

    @classmethod
    def from_estimate(cls, points: NDArray[np.float64]) -> Self:
        """Through points (n, 3) [m], least squares of distances."""
        middle = points.mean(axis=0)
        _, vectors = np.linalg.eigh((points - middle).T @ (points - middle))
        normal = vectors[:, 0]
        return cls(normal, float(normal @ middle))

    def residuals(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances (n,) [m]."""
        return np.asarray(np.abs(points @ self.normal - self.offset))

    def turned_to(self, points: NDArray[np.float64]) -> "_Plane":
        """The same with the normal on the side of most of ``points``."""
        if np.median(points @ self.normal) >= self.offset:
            return self
        return _Plane(-self.normal, -self.offset)

    def carries(self, target: NDArray[np.float64], world_from_camera: NDArray[np.float64] | None) -> bool:
        """Whether an object with these points may stand on it."""
        heights = np.quantile(target @ self.normal - self.offset, (0.02, 0.1))
        stands = heights[0] >= -2.0 * ON_PLANE and (heights[0] <= CONTACT_GAP or self.faces_view(target))
        level = world_from_camera is None or float(world_from_camera[2, :3] @ self.normal) >= MIN_UPRIGHTNESS
        return bool(stands and level)

    def faces_view(self, target: NDArray[np.float64]) -> bool:
        """Whether the camera looks at the target so steeply that its lower part is not seen."""
        view = target.mean(axis=0)
        return bool(-(view @ self.normal) >= STEEP * np.linalg.norm(view))

    def surface(self, scene_from_camera: NDArray[np.float64]) -> SupportSurface:
        """As a scene says it."""
        x, y, z = (scene_from_camera[:3, :3] @ self.normal).tolist()
        return SupportSurface("support", (x, y, z), self.offset + float(scene_from_camera[:3, 3] @ (x, y, z)))


def _find_support(
    around: NDArray[np.float64], target: NDArray[np.float64], world_from_camera: NDArray[np.float64] | None
) -> tuple[_Plane, NDArray[np.bool_]]:
    """The plane that the target stands on, camera frame, and which points (n, 3) lie in it.

    Walls may be larger, so planes are taken out one after the other until one carries the target.
    """
    with extra("clouds"):
        from skimage.measure import ransac

    rng, left = np.random.default_rng(0), around
    for _ in range(PLANES):
        if len(left) < MIN_POINTS:
            break
        shown = left[rng.choice(len(left), min(len(left), FITTED), replace=False)]
        plane, inliers = ransac(shown, _Plane, 3, ON_PLANE, max_trials=TRIALS, rng=0)
        if plane is None or inliers.sum() < max(3, MIN_SHARE * len(shown)):
            break
        plane = plane.turned_to(target)
        if plane.carries(target, world_from_camera):
            return plane, plane.residuals(around) <= ON_PLANE
        left = left[plane.residuals(left) > ON_PLANE]
    raise SceneError(
        "support",
        f"was not found: no plane in the {len(around):,} points around the object carries it; give it instead.",
    )
