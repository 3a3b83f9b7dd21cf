"""Distances of primitive shapes against MuJoCo's."""

import math
from itertools import product

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CYLINDER, SPHERE, shape_distance
from fingersplit.scene.convex_kernel import GJK_ROWS, shape_to_shape

KINDS = {"sphere": SPHERE, "capsule": CAPSULE, "cylinder": CYLINDER, "box": BOX}
CENTER = np.array([0.1, 0.2, 0.3])


def mujoco_distance(first, second):
    """Distance [m] and the nearest points (2, 3) [m] of two geoms, each kind, size, rotation and centre."""
    spec = mujoco.MjSpec()
    for kind, size, rotation, center in (first, second):
        spec.worldbody.add_geom(type=kind, size=size, quat=rotation.as_quat(scalar_first=True), pos=center)
    model = spec.compile()
    model.opt.ccd_tolerance, model.opt.ccd_iterations = 1e-10, 500
    data, ends = mujoco.MjData(model), np.zeros(6)
    mujoco.mj_forward(model, data)
    return mujoco.mj_geomDistance(model, data, 0, 1, 10.0, ends), ends.reshape(2, 3)


def measured(first, second, reach=10.0):
    flat = []
    for kind, size, rotation, center in (first, second):
        flat += [kind, size, rotation.as_matrix(), tuple(center)]
    return shape_to_shape(*flat, reach, np.zeros((GJK_ROWS, 3)))


@pytest.mark.parametrize(("kind", "other"), list(product(KINDS, KINDS)))
def test_distances_are_mujocos(kind, other):
    rng = np.random.default_rng([KINDS[kind], KINDS[other]])
    apart = 0
    for trial in range(60):
        rotations = [Rotation.identity()] * 2 if trial % 6 == 0 else Rotation.random(2, rng=rng)  # parallel faces, too
        first = KINDS[kind], rng.uniform(0.005, 0.06, 3), rotations[0], CENTER
        second = KINDS[other], rng.uniform(0.005, 0.3, 3), rotations[1], CENTER + rng.normal(0, 0.2, 3)
        distance, point, away = measured(first, second)
        expected, _ = mujoco_distance(first, second)
        if expected > 1e-5:
            apart += 1
            assert distance == pytest.approx(expected, abs=3e-6)
            local = second[2].inv().apply(np.array(point) - second[3])
            assert shape_distance(second[0], second[1], *local) == pytest.approx(0.0, abs=1e-5)
            local = first[2].inv().apply(np.array(point) - distance * np.array(away) - first[3])
            assert shape_distance(first[0], first[1], *local) == pytest.approx(0.0, abs=2e-5)
        elif expected < -1e-5:
            assert distance < 0
            assert distance <= expected + 1e-4  # a depth is never too small
    assert apart > 5


def test_far_shapes_are_only_known_to_be_far():
    box = BOX, np.array([0.1, 0.1, 0.1]), Rotation.identity()
    far = (*box, np.array([1.0, 0, 0]))
    assert measured((*box, np.zeros(3)), far, reach=0.5)[0] == math.inf
    assert measured((*box, np.zeros(3)), far, reach=0.9)[0] == pytest.approx(0.8, abs=1e-6)


def test_boxes_that_overlap_are_as_deep_as_their_least_overlap():
    box = BOX, np.array([0.1, 0.2, 0.3]), Rotation.identity()
    depth, _, away = measured((*box, np.zeros(3)), (*box, np.array([0.05, 0.39, 0.0])))
    assert depth == pytest.approx(-0.01)
    np.testing.assert_allclose(away, [0, 1, 0], atol=1e-12)


def test_shapes_with_one_centre_overlap():
    ball = SPHERE, np.array([0.1, 0, 0]), Rotation.identity(), CENTER
    assert measured(ball, ball)[0] == pytest.approx(-0.2)
