"""The nearest point and its normal against exact triangle distances, on every object."""

import numpy as np
import pytest

from fingersplit.objects.surface import closest, touch

pytestmark = pytest.mark.campaign


def test_nearest_points_and_normals_are_those_of_the_triangles(every_object, exact_mesh):
    surface, rng = every_object.surface, np.random.default_rng(3)
    picked = rng.integers(len(surface.normals), size=1_000)
    queries = surface.grid.points[picked] + rng.uniform(0.2e-3, 15e-3, (1_000, 1)) * surface.normals[picked]
    exact = exact_mesh(every_object.mesh).distance(queries)
    touched = np.array([touch(surface, tuple(query), -1)[0] for query in queries])
    assert np.percentile(np.abs(touched - exact), 99) < 0.3e-3
    found = [closest(surface, tuple(query), -1) for query in queries]
    points, normals = np.array([point for _, point, _ in found]), np.array([normal for _, _, normal in found])
    # At sharp edges, the tangent plane of the nearest sample goes on beyond the surface for up to a spacing.
    assert np.percentile(np.abs(np.linalg.norm(queries - points, axis=1) - exact), 99) < 0.75 * surface.spacing
    _, _, faces = every_object.mesh.trimesh.nearest.on_surface(queries)
    cosines = (normals * every_object.mesh.trimesh.face_normals[faces]).sum(axis=1)
    assert np.median(cosines) > np.cos(np.radians(6))
