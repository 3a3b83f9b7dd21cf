"""The prepared object: mass, size and collision points."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import COLLISION_POINTS, prepare_object
from fingersplit.objects.surface import PACKING


def test_mass_is_that_of_the_assumed_density_up_to_a_cap():
    small, large = prepare_object(box((0.03, 0.04, 0.05))), prepare_object(box((0.2, 0.2, 0.2)))
    assert small.mass == pytest.approx(500 * 0.03 * 0.04 * 0.05)
    assert large.mass == 0.5


def test_radius_is_the_farthest_corner():
    model = prepare_object(box((0.03, 0.04, 0.12)))
    corner = np.linalg.norm([0.015, 0.02, 0.06])
    assert corner - model.surface.spacing < model.radius <= corner


def test_collision_points_are_samples_and_cover_the_surface(prepared):
    model = prepared("mug")
    points, samples = model.collision.points, model.surface.grid.points
    # Samples fill 0.52 of a square of their spacing each (PACKING); supervoxels are seeded by thinning them again,
    # which has more to choose from and comes nearer to 0.697, where random disks leave no room for another.
    assert COLLISION_POINTS < len(points) < COLLISION_POINTS * 0.697 / PACKING
    assert cKDTree(samples).query(points)[0].max() == 0
    spacing = model.surface.spacing * np.sqrt(len(samples) / 2_000)
    gaps, _ = cKDTree(points).query(samples)
    assert np.percentile(gaps, 99) < spacing
    assert gaps.max() < 2 * spacing


def test_document_states_the_object(prepared):
    model = prepared("box")
    document = model.to_document()
    assert document["id"] == model.mesh.content_hash
    assert document["name"] == "box"
    assert document["samples"] == len(model.surface.normals)
    assert document["sample_spacing"] == model.surface.spacing
    np.testing.assert_allclose(document["extents"], [0.05, 0.07, 0.12])
    assert document["mass"] == pytest.approx(500 * document["volume"])
