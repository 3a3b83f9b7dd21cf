"""Point clouds as a depth camera would measure them."""

import numpy as np

from fingersplit.objects.cloud import PointCloud
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.scatter import scatter


def one_view(mesh: Mesh, towards: tuple[float, float, float], noise: float = 1e-3, count: int = 12_000) -> PointCloud:
    """Points of a mesh that a camera 0.6 m away in a direction sees, with noise of a standard deviation [m]."""
    rng = np.random.default_rng(0)
    viewpoint = mesh.bounds.mean(axis=0) + 0.6 * np.asarray(towards) / np.linalg.norm(towards)
    points, faces = scatter(mesh, 6 * count, rng)
    normals = mesh.trimesh.face_normals[faces]
    rays = viewpoint - points
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    facing = (rays * normals).sum(axis=1) > 0.1
    points, rays, normals = points[facing], rays[facing], normals[facing]
    free = ~mesh.trimesh.ray.intersects_any(points + 1e-5 * normals, rays)
    points = points[free][:count]
    return PointCloud(points + rng.normal(scale=noise, size=points.shape), viewpoint=viewpoint)
