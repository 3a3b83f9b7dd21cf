"""Antipodal pairs: on the surface, inside both cones, within the jaws, spread and reproducible."""

import math

import numpy as np
import pytest
import trimesh

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.preparing import prepare_object
from fingersplit.parallel_grasps.sources.antipodal import sample_antipodal

FRICTION = 0.4


def sample(model, count=10, approaches=4, opening=(0.0, 0.2), friction=FRICTION, seed=0):
    rng = np.random.default_rng(seed)
    return sample_antipodal(model, count, friction=friction, opening=opening, approaches=approaches, rng=rng)


@pytest.mark.parametrize("name", ["box", "cylinder", "ellipsoid", "l_bracket", "mug"])
def test_pairs_oppose_each_other_across_the_object(prepared, exact_mesh, name):
    model = prepared(name)
    grasps = sample(model)
    assert len(grasps) == 40
    pairs = np.array([grasp.contacts for grasp in grasps])
    assert exact_mesh(model.mesh).distance(pairs.reshape(-1, 3)).max() < 1e-6
    widths = np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1)
    assert (widths >= 2e-3).all()
    assert (widths <= 0.2).all()
    jaws = (pairs[:, 0] - pairs[:, 1]) / widths[:, None]
    for end, inward in ((0, -jaws), (1, jaws)):
        assert model.mesh.trimesh.contains(pairs[:, end] + 1e-4 * inward).all()
        cosines = [cosine_to_surface(model, *ray) for ray in zip(pairs[:, end], -inward, strict=True)]
        assert min(cosines) >= math.cos(math.atan(FRICTION)) - 0.02


def cosine_to_surface(model, point, outward) -> float:
    """Best alignment of a direction with the normals of the samples about a point."""
    near = np.linalg.norm(model.surface.grid.points - point, axis=1) < 2.5 * model.surface.spacing
    return float((model.surface.normals[near] @ outward).max())


def test_approaches_turn_evenly_about_the_jaw(prepared):
    grasps = sample(prepared("box"), approaches=8)
    for k in range(0, len(grasps), 8):
        group = list(grasps[k : k + 8])
        contacts = group[0].contacts
        jaw = (contacts[0] - contacts[1]) / np.linalg.norm(contacts[0] - contacts[1])
        for grasp, following in zip(group, group[1:] + group[:1], strict=True):
            np.testing.assert_array_equal(grasp.contacts, contacts)
            assert abs(grasp.approach @ jaw) < 1e-12
            assert math.acos(grasp.approach @ following.approach) == pytest.approx(2 * math.pi / 8)


def test_pairs_differ(prepared):
    model = prepared("cylinder")
    pairs = np.array([grasp.contacts for grasp in sample(model, approaches=1)])
    for i, pair in enumerate(pairs):
        for other in pairs[:i]:
            straight, swapped = (np.linalg.norm(pair - end, axis=1).mean() for end in (other, other[::-1]))
            assert min(straight, swapped) >= 0.02 * model.radius


def test_opening_limits_the_width(prepared):
    model = prepared("box")  # 50 x 70 x 120 mm
    assert len(sample(model, opening=(0.0, 0.045))) == 0
    pairs = np.array([grasp.contacts for grasp in sample(model, opening=(0.06, 0.08))])
    widths = np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1)
    assert len(widths)
    assert widths.min() >= 0.06
    assert widths.max() <= 0.08


@pytest.mark.parametrize("thickness", [0.2e-3, 0.5e-3, 0.76e-3, 1.5e-3, 2.5e-3])
def test_sheets_have_pairs_through_them_however_thin(thickness):
    solid = trimesh.creation.box((0.06, 0.04, thickness))
    sheet = prepare_object(Mesh(solid.vertices, solid.faces))
    pairs = np.array([grasp.contacts for grasp in sample(sheet, count=50)])
    widths = np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1)
    assert np.mean(widths < 1.2 * thickness) > 0.5
    assert widths.min() >= thickness * (1 - 1e-9)


def test_slippery_round_objects_still_have_pairs_through_the_middle(prepared):
    pairs = np.array([grasp.contacts for grasp in sample(prepared("sphere"), friction=0.05)])
    assert len(pairs)
    assert np.linalg.norm(pairs.mean(axis=1), axis=1).max() < 0.05 * 0.035


def test_contacts_keep_off_edges(prepared):
    """On the box of 50 x 70 x 120 mm, jaws score on faces, farther from every edge than samples from each other."""
    model = prepared("box")
    contacts = sample(model, count=200, approaches=1).contacts.reshape(-1, 3)
    from_sides = np.sort(np.array([0.025, 0.035, 0.06]) - np.abs(contacts), axis=1)
    assert np.abs(from_sides[:, 0]).max() < 1e-9  # on a face
    assert from_sides[:, 1].min() > model.surface.spacing


def test_pairs_cover_a_long_object(prepared):
    """Along the 110 mm of a cylinder no stretch of a quarter goes without a pair."""
    middles = sample(prepared("cylinder"), count=60, approaches=1).contacts.mean(axis=1)
    heights, _ = np.histogram(middles[:, 2], bins=4, range=(-0.055, 0.055))
    assert heights.min() > 0


def test_seed_decides(prepared):
    model = prepared("mug")

    def numbers(seed):
        return [(grasp.contacts.tolist(), grasp.approach.tolist()) for grasp in sample(model, seed=seed)]

    assert numbers(3) == numbers(3)
    assert numbers(3) != numbers(4)
