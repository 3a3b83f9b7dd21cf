"""Implicit fairing: noise goes, volume, place and size stay, and the strength is what it says."""

import numpy as np
import pytest
import trimesh

from fingersplit.objects.fairing import fair
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.preparing import prepare_object

RADIUS = 0.05


def ball() -> Mesh:
    shape = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    return Mesh(shape.vertices + np.array([0.1, 0.2, 0.3]), shape.faces)


def noisy(mesh: Mesh, height: float) -> Mesh:
    rng = np.random.default_rng(0)
    return Mesh(mesh.vertices + rng.normal(scale=height, size=mesh.vertices.shape), mesh.faces)


def roughness(mesh: Mesh) -> float:
    return float(np.std(np.linalg.norm(mesh.vertices - [0.1, 0.2, 0.3], axis=1)))


def test_noise_goes_and_volume_stays():
    rough = noisy(ball(), 0.5e-3)
    smooth = fair(rough, 0.02)
    assert roughness(smooth) < 0.4 * roughness(rough)
    assert roughness(fair(rough, 0.05)) < 0.5 * roughness(smooth)
    assert smooth.volume == pytest.approx(rough.volume, rel=1e-9)
    np.testing.assert_allclose(smooth.center_of_mass, rough.center_of_mass, atol=0.05e-3)
    assert np.array_equal(smooth.faces, rough.faces)


def test_smooth_ball_is_left_as_it_is():
    np.testing.assert_allclose(fair(ball(), 0.01).vertices, ball().vertices, atol=2e-5)


@pytest.mark.parametrize(("wavelength", "kept"), [(0.01, 0.8), (0.02, 0.5), (0.04, 0.2)])
def test_waves_of_the_given_length_lose_half_their_height(wavelength, kept):
    n, length, height = 161, 0.02, 0.1e-3
    x, y = np.meshgrid(np.linspace(0, 0.16, n), np.linspace(0, 0.02, 21), indexing="ij")
    points = np.stack([x, y, height * np.cos(2 * np.pi * x / length)], axis=-1).reshape(-1, 3)
    corner = (np.arange(n - 1)[:, None] * 21 + np.arange(20)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 21, corner + 22], 1), np.stack([corner, corner + 22, corner + 1], 1)]
    )
    smooth = fair(Mesh(points, faces), wavelength).vertices.reshape(n, 21, 3)
    crests = np.abs(smooth[40:121:10, 10, 2])  # away from the rims, which stay in place
    assert crests / height == pytest.approx(kept, abs=0.08)
    np.testing.assert_allclose(smooth[0], points.reshape(n, 21, 3)[0], atol=1e-15)


def test_slivers_and_strong_fairing_leave_a_usable_surface():
    shape = trimesh.creation.cylinder(radius=0.02, height=0.1, sections=64)  # fans of slivers on both ends
    smooth = fair(Mesh(shape.vertices, shape.faces), 0.03)
    assert np.isfinite(smooth.vertices).all()
    assert smooth.volume == pytest.approx(shape.volume, rel=1e-9)


def test_model_is_faired_and_keeps_the_name_of_what_it_was():
    rough = noisy(ball(), 0.3e-3)
    plain, faired = prepare_object(rough), prepare_object(rough, options=ObjectOptions(fairing=0.02))
    radial = (faired.surface.grid.points - [0.1, 0.2, 0.3]) / RADIUS
    before = (plain.surface.grid.points - [0.1, 0.2, 0.3]) / RADIUS
    assert np.mean((faired.surface.normals * radial).sum(axis=1)) > np.mean(
        (plain.surface.normals * before).sum(axis=1)
    )
    assert faired.shape_hash == plain.id == rough.content_hash != faired.id
    assert faired.mesh.content_hash != rough.content_hash
