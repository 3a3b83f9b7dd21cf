"""Grasps from surface fitting: on the surface, inside the cones, within the jaws, free of the body, reproducible."""

import math

import numpy as np
import pytest

from fingersplit.parallel_grasps.fitting_kernel import new_fit
from fingersplit.parallel_grasps.guided_starts_kernel import body_points, guided_fits
from fingersplit.parallel_grasps.sources.surface_fitting import PadGripper, _regions, fit_surfaces

GRIPPER = PadGripper((0.0, 0.1))
FRICTION = 0.5


def fitted(model, count=16, seed=0, gripper=GRIPPER):
    return fit_surfaces(model, count, gripper=gripper, friction=FRICTION, rng=np.random.default_rng(seed))


@pytest.mark.parametrize("name", ["box", "cylinder", "ellipsoid", "mug"])
def test_contacts_lie_on_opposite_sides_of_the_surface(prepared, exact_mesh, name):
    model = prepared(name)
    grasps = fitted(model)
    assert len(grasps) >= 4
    distances = exact_mesh(model.mesh).distance(grasps.contacts.reshape(-1, 3))
    assert distances.max() < 1e-6
    jaws = grasps.contacts[:, 0] - grasps.contacts[:, 1]
    widths = np.linalg.norm(jaws, axis=1)
    assert widths.max() <= 0.1
    assert np.abs(np.einsum("ij,ij->i", jaws / widths[:, None], grasps.approaches)).max() < 0.87
    middles = grasps.contacts.mean(axis=1, keepdims=True)
    inwards = (middles - grasps.contacts) / np.linalg.norm(middles - grasps.contacts, axis=2, keepdims=True)
    assert model.mesh.trimesh.contains((grasps.contacts + 1e-3 * inwards).reshape(-1, 3)).mean() > 0.95


def test_box_is_held_by_its_faces(prepared):
    """Flat pads on a 50 x 70 x 120 mm box: the jaws stand square to the faces, 50 or 70 mm apart."""
    grasps = fitted(prepared("box"))
    jaws = grasps.contacts[:, 0] - grasps.contacts[:, 1]
    widths = np.linalg.norm(jaws, axis=1)
    assert (np.abs(jaws / widths[:, None]).max(axis=1) > math.cos(0.1)).all()
    assert all(min(abs(width - 0.05), abs(width - 0.07)) < 2e-3 for width in widths)


def test_opening_limits_what_is_found(prepared):
    narrow = fitted(prepared("box"), gripper=PadGripper((0.0, 0.06)))
    widths = np.linalg.norm(narrow.contacts[:, 0] - narrow.contacts[:, 1], axis=1)
    assert len(widths)
    assert widths == pytest.approx(0.05, abs=2e-3)
    assert len(fitted(prepared("box"), gripper=PadGripper((0.0, 0.03)))) == 0


def test_body_collides_where_it_does(prepared):
    """A gripper across the box is free; pushed on until the box meets its palm, or with thick walls, it is not."""
    model, body = prepared("box"), GRIPPER.body
    fit = new_fit(2)
    fit.rotation[:] = np.column_stack([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    fit.width[0] = 0.05
    top = model.mesh.bounds[1, 2]
    middle = model.mesh.bounds.mean(axis=0)
    fit.position[:] = middle[0], middle[1], top - 0.02
    points, most = model.surface.grid.points, len(model.surface.normals)
    assert body_points(points, body, fit, most) == 0
    fit.position[2] = top - GRIPPER.reach - 0.005
    assert body_points(points, body, fit, most) > 100
    fit.position[2], fit.width[0] = top - 0.02, 0.03
    assert body_points(points, body, fit, most) > 100
    assert body_points(points, body, fit, 7) == 7


def test_regions_that_fail_are_tried_less(prepared):
    """With a cone so narrow that only flat faces pass, starts gather where they pay."""
    model, rng = prepared("mug"), np.random.default_rng(0)
    starts = 400
    _, trials, regrets = guided_fits(
        model.triangles,
        model.surface,
        model.collision.points,
        _regions(model, rng),
        GRIPPER.pad_points,
        GRIPPER.body,
        GRIPPER.opening,
        math.cos(math.atan(FRICTION)),
        rng.random((starts, 4)),
        new_fit(2 * len(GRIPPER.pad_points)),
        np.zeros((starts, 2, 3)),
        np.zeros((starts, 3)),
    )
    assert trials.sum() == starts
    assert (regrets <= trials).all()
    successes = (trials - regrets) / np.maximum(trials, 1)
    good, bad = successes > np.median(successes), successes <= np.median(successes)
    assert trials[good].mean() > 1.2 * trials[bad].mean()


def test_regions_hold_each_sample_once(prepared):
    starts, samples = _regions(prepared("cylinder"), np.random.default_rng(0))
    assert starts[0] == 0
    assert starts[-1] == len(samples) == len(set(samples.tolist()))
    assert (np.diff(starts) > 0).all()


def test_seed_decides(prepared):
    model = prepared("mug")
    np.testing.assert_array_equal(fitted(model, seed=3).contacts, fitted(model, seed=3).contacts)
    assert fitted(model, seed=3).contacts.tolist() != fitted(model, seed=4).contacts.tolist()


def test_grasps_differ(prepared):
    model = prepared("cylinder")
    grasps = fitted(model)
    for i, pair in enumerate(grasps.contacts):
        for other in grasps.contacts[:i]:
            apart = min(np.linalg.norm(pair - other, axis=1).mean(), np.linalg.norm(pair - other[::-1], axis=1).mean())
            assert apart >= 0.02 * model.radius
