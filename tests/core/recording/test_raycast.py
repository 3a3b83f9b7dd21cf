"""The software renderer against geometry that is known."""

import math

import numpy as np
import pytest
import trimesh

from fingersplit.recording.raycast import Camera, Layer, render, unobstructed

RED, BLUE = (0.9, 0.1, 0.1, 1.0), (0.1, 0.1, 0.9, 1.0)


def ball(center, radius, rgba):
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return Layer(mesh.vertices + np.asarray(center), mesh.faces, rgba)


@pytest.fixture
def camera():
    return Camera(np.array([0.0, -1.0, 0.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.4, (160, 120))


def test_a_sphere_covers_the_disc_that_perspective_says(camera):
    radius = 0.1
    image = render([ball((0, 0, 0), radius, RED)], camera, shadow=False)
    # The tangent cone of a ball seen from distance d has half angle asin(r / d).
    pixels = math.tan(math.asin(radius)) / math.tan(0.2) * 120 / 2
    covered = image[..., 3].sum()
    assert covered == pytest.approx(math.pi * pixels**2, rel=0.02)
    rows, columns = np.nonzero(image[..., 3] > 0.5)
    assert rows.mean() == pytest.approx(59.5, abs=0.6)
    assert columns.mean() == pytest.approx(79.5, abs=0.6)


@pytest.mark.parametrize("order", [1, -1])
def test_the_nearer_body_hides_the_farther_one(camera, order):
    layers = [ball((0, -0.3, 0), 0.05, RED), ball((0, 0.3, 0), 0.05, BLUE)][::order]
    middle = render(layers, camera, shadow=False)[60, 80]
    assert middle[0] > 2 * middle[2]


def test_a_translucent_body_lets_the_one_behind_through(camera):
    behind = ball((0, 0.3, 0), 0.05, BLUE)
    seen = {
        opacity: render([ball((0, -0.3, 0), 0.05, (*RED[:3], opacity)), behind], camera, shadow=False)[60, 80]
        for opacity in (0.3, 0.7, 1.0)
    }
    assert seen[0.3][2] > seen[0.7][2] > seen[1.0][2]
    assert seen[0.3][0] < seen[0.7][0] < seen[1.0][0]


def test_up_is_up_and_right_is_right(camera):
    image = render([ball((0.1, 0, 0.1), 0.03, RED)], camera, shadow=False)
    rows, columns = np.nonzero(image[..., 3] > 0.5)
    assert rows.max() < 60
    assert columns.min() > 80


def test_framing_keeps_every_point_in_view():
    points = np.random.default_rng(0).uniform(-0.2, 0.3, (200, 3))
    camera = Camera.framing(points, np.array([1.0, -2.0, 0.7]), np.array([0.0, 0.0, 1.0]), size=(200, 150))
    seen = (points - camera.eye) @ camera.axes.T
    half = math.tan(camera.field_of_view / 2)
    assert (np.abs(seen[:, 1] / -seen[:, 2]) <= half).all()
    assert (np.abs(seen[:, 0] / -seen[:, 2]) <= half * 200 / 150).all()


def test_unobstructed_tells_free_from_blocked_ways():
    wall = [ball((0, 0, 1), 0.2, RED)]
    points = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])
    np.testing.assert_array_equal(unobstructed(wall, points, np.tile([0.0, 0.0, 1.0], (2, 1))), [False, True])
