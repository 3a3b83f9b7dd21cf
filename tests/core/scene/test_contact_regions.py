"""Regions of contact on real surfaces."""

import numpy as np
import pytest

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.objects.preparing import prepare_object
from fingersplit.scene import ContactRegions, Pose, Region


@pytest.fixture(scope="module")
def model():
    return prepare_object(PARAMETRIC_OBJECTS["box"](), "box")


def test_regions_hold_what_lies_in_them(model):
    points = model.surface.grid.points
    turned = Pose((0.01, 0, 0), (np.cos(0.3), 0, 0, np.sin(0.3)))
    local = (points - [0.01, 0, 0]) @ turned.matrix[:3, :3]
    cloud = points[:5]
    face = 3
    corners = model.mesh.vertices[model.mesh.faces[face]]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    cases = [
        (Region("half_space", normal=(0, 0, 2), offset=0.01), points[:, 2] <= 0.01),
        (Region("box", turned, dimensions=(0.04, 0.06, 0.5)), (np.abs(local) <= [0.02, 0.03, 0.25]).all(axis=1)),
        (Region("sphere", turned, radius=0.03), np.linalg.norm(points - [0.01, 0, 0], axis=1) <= 0.03),
        (
            Region("near_cloud", points=cloud, distance=0.01),
            (np.linalg.norm(points[:, None] - cloud, axis=2) <= 0.01).any(axis=1),
        ),
    ]
    for region, expected in cases:
        assert 0 < expected.sum() < len(points)
        np.testing.assert_array_equal(region.contains(points, model), expected)
    on_face = Region("faces", faces=[face]).contains(points, model)
    assert 0 < on_face.sum() < len(points)
    assert np.abs((points[on_face] - corners[0]) @ normal / np.linalg.norm(normal)).max() < 1e-6


def test_forbidden_outweighs_allowed(model):
    points = model.surface.grid.points
    upper, lower = (
        Region("half_space", normal=(0, 0, -1), offset=0.0),
        Region("half_space", normal=(0, 0, 1), offset=0.01),
    )
    admitted = ContactRegions((upper,), (lower,)).admit(points, model)
    np.testing.assert_array_equal(admitted, points[:, 2] > 0.01)
    assert ContactRegions().admit(points, model).all()
    assert not ContactRegions((upper,), (upper,)).admit(points, model).any()
