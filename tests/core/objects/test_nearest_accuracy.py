"""The nearest point and its normal against exact triangle distances, on every object."""

import numpy as np
import pytest

from fingersplit.objects.scatter import scatter
from fingersplit.objects.surface_kernel import closest, touch

pytestmark = pytest.mark.campaign


def test_nearest_points_and_normals_are_those_of_the_triangles(every_object, exact_mesh):
    """Where pads ask: about any point of the triangles, from 1 mm inside to farther than a pad's centre."""
    surface, mesh, rng = every_object.surface, every_object.mesh, np.random.default_rng(3)
    feet, faces = scatter(mesh, 2_000, rng)
    queries = feet + rng.uniform(-1e-3, 15e-3, (2_000, 1)) * mesh.trimesh.face_normals[faces]
    queries += rng.normal(scale=1e-3, size=queries.shape)
    exact = exact_mesh(mesh).distance(queries)
    touched = np.array([touch(surface, tuple(query), -1)[0] for query in queries])
    assert np.percentile(np.abs(touched - exact), 99) < 0.3e-3
    found = [closest(surface, tuple(query), -1) for query in queries]
    points, normals = np.array([point for _, point, _ in found]), np.array([normal for _, _, normal in found])
    assert np.percentile(np.abs(np.linalg.norm(queries - points, axis=1) - exact), 99) < 0.3e-3
    _, _, faces = mesh.trimesh.nearest.on_surface(queries)
    cosines = (normals * mesh.trimesh.face_normals[faces]).sum(axis=1)
    assert np.median(cosines) > np.cos(np.radians(6))
