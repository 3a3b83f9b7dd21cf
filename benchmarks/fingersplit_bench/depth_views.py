"""Depth images of objects on a table, by casting a ray for every pixel."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.objects.mesh import Mesh
from fingersplit.scene.view import View

__all__ = ["Camera", "look_at", "render_view"]


@dataclass(frozen=True)
class Camera:
    """A camera without distortion: size and focal length in pixels."""

    width: int = 320
    height: int = 240
    focal: float = 300.0

    @property
    def intrinsics(self) -> tuple[float, float, float, float]:
        """fx, fy, cx, cy [pixels]."""
        return self.focal, self.focal, (self.width - 1) / 2, (self.height - 1) / 2


def look_at(eye: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pose (4, 4) of a camera at ``eye`` that looks at ``target`` with the world's z up in its image."""
    pose = np.eye(4)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = eye
    return pose


def render_view(
    mesh: Mesh, world_from_object: NDArray[np.float64], world_from_camera: NDArray[np.float64], camera: Camera
) -> View:
    """What a camera sees of an object on the plane z = 0, with the noise of a good one."""
    fx, fy, cx, cy = camera.intrinsics
    rows, columns = np.indices((camera.height, camera.width))
    rays = np.stack([(columns - cx) / fx, (rows - cy) / fy, np.ones(rows.shape)], axis=2).reshape(-1, 3)
    directions = rays @ world_from_camera[:3, :3].T
    eye = world_from_camera[:3, 3]
    with np.errstate(divide="ignore"):
        table = np.where(directions[:, 2] < 0.0, -eye[2] / directions[:, 2], np.inf)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    solid.apply_transform(world_from_object)
    places, hit, _ = solid.ray.intersects_location(np.tile(eye, (len(rays), 1)), directions, multiple_hits=False)
    depth, mask = table.copy(), np.zeros(len(rays), bool)
    along = (places - eye) @ world_from_camera[:3, 2]
    nearer = along < table[hit]
    depth[hit[nearer]], mask[hit[nearer]] = along[nearer], True
    depth[~np.isfinite(depth) | (depth > 3.0)] = 0.0
    noise = np.random.default_rng(0).normal(0.0, 5e-4, depth.shape) * (depth > 0.0)
    shape = camera.height, camera.width
    return View.from_depth(
        (depth + noise).reshape(shape),
        mask.reshape(shape),
        camera.intrinsics,
        world_from_camera=world_from_camera,
    )
