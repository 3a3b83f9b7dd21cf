"""Closing jaws on a mesh by rays."""

import numpy as np
import pytest

from fingersplit.parallel_grasps.closing_kernel import close_jaws


def close(model, center=(0, 0, 0), axis=(1, 0, 0), approach=(0, 0, -1), opening=0.1, pad=(0.0, 0.0)):
    contacts = np.zeros((1, 2, 3))
    rows = (np.array([value], dtype=np.float64) for value in (center, axis, approach))
    touched = close_jaws(model.triangles, *rows, np.array([opening]), np.array([pad]), contacts)
    return bool(touched[0]), contacts[0]


def test_points_meet_the_faces_of_a_box(prepared):
    model = prepared("box")
    touched, contacts = close(model, center=(0.01, 0.005, 0.02))
    assert touched
    np.testing.assert_allclose(contacts, [[0.025, 0.005, 0.02], [-0.025, 0.005, 0.02]], atol=1e-12)


def test_pads_meet_what_stands_out_first(prepared):
    """A pad over the rim of an ellipsoid touches its highest point, not what lies under the pad's middle."""
    model = prepared("ellipsoid")
    half = model.mesh.extents[0] / 2
    middle = model.mesh.bounds.mean(axis=0)
    offset = middle + np.array([0, 0.012, 0])
    touched, points = close(model, center=offset, opening=0.12)
    assert touched
    touched, pads = close(model, center=offset, opening=0.12, pad=(0.03, 0.016))
    assert touched
    assert pads[0, 0] > points[0, 0]
    assert half - 1.5e-3 < pads[0, 0] - middle[0] <= half
    assert abs(pads[0, 1] - middle[1]) < abs(points[0, 1] - middle[1])


def test_flat_faces_are_touched_at_the_middle_of_the_pad(prepared):
    touched, contacts = close(prepared("box"), pad=(0.02, 0.02))
    assert touched
    np.testing.assert_allclose(contacts[:, 1:], 0, atol=1e-12)


@pytest.mark.parametrize(
    "pose",
    [
        {"center": (0, 0, 0.2)},  # beside the object
        {"opening": 0.04},  # the jaws start inside
        {"center": (0.06, 0, 0), "opening": 0.05},  # both on one side: one meets it, the other nothing
    ],
)
def test_jaws_that_do_not_hold(prepared, pose):
    assert not close(prepared("box"), **pose)[0]
