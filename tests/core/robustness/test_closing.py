"""Kinematic closings and surroundings of contacts, against displaced palms and closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingersplit.robustness.closing import AROUND, CLOSING_MEANS, ClosingDraws, close_kinematically, surroundings


def draws(displacements, turns, frictions=None):
    turns = np.asarray(turns, float).reshape(-1, 3)
    frictions = np.full(len(turns), 0.6) if frictions is None else frictions
    return ClosingDraws(Rotation.from_rotvec(turns).as_matrix(), np.asarray(displacements, float), frictions)


def means(found, candidates, *given):
    rows = close_kinematically(found.hand, found.model, candidates, draws(*given))
    return [dict(zip(CLOSING_MEANS, row, strict=True)) for row in rows]


@pytest.mark.parametrize("name", ["mug", "sphere"])
def test_fingers_arrive_where_the_object_is_as_planned(judgeable, name):
    found, _, candidates = judgeable(name)
    for row in means(found, [one for one, _ in candidates], [[0, 0, 0]], [[0, 0, 0]]):
        assert row["all_arrive"] == row["arriving"] == 1.0
        assert name == "mug" or row["pad_tilt"] < 0.7  # beside a rim the nearest normal may be another wall's
        assert row["link_depth"] < 5e-3
    for row in means(found, [one for one, _ in candidates], [[0.5, 0, 0]], [[0, 0, 0]]):
        assert row["all_arrive"] == row["arriving"] == 0.0


def test_a_displaced_object_is_a_hand_displaced_the_other_way(judgeable):
    rng = np.random.default_rng(0)
    found, _, candidates = judgeable("mug")
    center = found.model.center_of_mass
    for _ in range(4):
        moved, turn = rng.normal(0, 3e-3, 3), rng.normal(0, 0.05, 3)
        for one, _ in candidates:
            world_from_object = np.eye(4)
            world_from_object[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
            world_from_object[:3, 3] = center + moved - world_from_object[:3, :3] @ center
            palm = np.linalg.inv(world_from_object) @ one.grasp.object_from_palm
            elsewhere = replace(one, grasp=replace(one.grasp, object_from_palm=palm))
            (displaced,) = means(found, [one], [moved], [turn])
            (other,) = means(found, [elsewhere], [[0, 0, 0]], [[0, 0, 0]])
            assert displaced == pytest.approx(other, abs=1e-6)


def test_friction_widens_the_cones(judgeable):
    found, _, candidates = judgeable("sphere")
    given = [[0, 0, 0]], [[0, 0, 0]]
    low, high = (means(found, [candidates[0][0]], *given, np.array([mu]))[0] for mu in (0.4, 0.8))
    assert high["cone_slack"] - low["cone_slack"] == pytest.approx(math.atan(0.8) - math.atan(0.4))


def test_surroundings_of_a_sphere_bend_as_they_must(prepared):
    model = prepared("sphere")
    points = model.surface.grid.points[::5000]
    radius = np.linalg.norm(points[0] - model.center_of_mass)
    normals = (points - model.center_of_mass) / radius
    around = surroundings(model, points, normals)
    assert around[:, 0] == pytest.approx(2 / 3 * AROUND / radius, rel=0.1)


def test_edges_are_seen(prepared):
    model = prepared("box")
    half = model.mesh.extents / 2
    low = model.mesh.vertices.min(axis=0)
    middle = low + half + np.array([half[0], 0, 0])
    near = middle + np.array([0, half[1] - 2e-3, 0])
    flat, edge = surroundings(model, np.array([middle, near]), np.array([[1.0, 0, 0]] * 2))
    assert flat[0] == pytest.approx(0.0, abs=1e-6)
    assert edge[0] > 0.3
