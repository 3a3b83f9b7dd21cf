"""Grasp metrics: known values, invariances, and Ferrari-Canny against a search over disturbance directions."""

import pathlib
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fingersplit.contacts.cones import cone_edges
from fingersplit.contacts.holding import Holding
from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import assess, available_metrics
from fingersplit.contacts.wrench_space import WrenchSpace

seeds = st.integers(0, 2**32 - 1)
RADIUS = 0.04


def on_sphere(directions, friction: float = 0.6) -> WrenchSpace:
    directions = np.asarray(directions, dtype=float)
    normals = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return WrenchSpace(RADIUS * normals, normals, friction, np.zeros(3), RADIUS)


def measure(name: str, space: WrenchSpace) -> float:
    return available_metrics()[name].function(GraspState(space, np.zeros(3)))


def isotropy(space: WrenchSpace) -> float:
    return measure("isotropy", space)


def volume(space: WrenchSpace) -> float:
    return measure("volume", space)


def ferrari_canny(space: WrenchSpace) -> float:
    return measure("ferrari_canny", space)


def equator(count: int = 3, friction: float = 0.6) -> WrenchSpace:
    angles = 2 * np.pi * np.arange(count) / count
    return on_sphere(np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1), friction)


def random_space(rng: np.random.Generator, friction: float = 0.8) -> WrenchSpace:
    """Three contacts about an equator, tilted at random."""
    angles = 2 * np.pi * np.arange(3) / 3 + rng.uniform(-0.3, 0.3, 3)
    heights = rng.uniform(-0.2, 0.2, 3)
    return on_sphere(np.stack([np.cos(angles), np.sin(angles), heights], axis=1), friction)


def moved(space: WrenchSpace, rotation: np.ndarray, shift: np.ndarray, scale: float) -> WrenchSpace:
    return WrenchSpace(
        scale * space.contacts @ rotation.T + shift,
        space.normals @ rotation.T,
        space.friction,
        scale * rotation @ space.center + shift,
        scale * space.radius,
    )


def test_grasp_matrix_stacks_force_and_scaled_torque():
    space = random_space(np.random.default_rng(0))
    forces = np.random.default_rng(1).normal(size=(3, 3))
    wrench = space.grasp_matrix() @ forces.ravel()
    np.testing.assert_allclose(wrench[:3], forces.sum(axis=0))
    np.testing.assert_allclose(RADIUS * wrench[3:], np.cross(space.contacts, forces).sum(axis=0))


@given(seeds)
def test_cone_edges_press_inwards_on_the_cone(seed):
    space = random_space(np.random.default_rng(seed), friction=0.45)
    edges = cone_edges(space.normals, space.friction)
    normal_parts = -np.einsum("fec,fc->fe", edges, space.normals)
    np.testing.assert_allclose(normal_parts, 1, atol=1e-12)
    sideways = edges + normal_parts[:, :, None] * space.normals[:, None]
    np.testing.assert_allclose(np.linalg.norm(sideways, axis=2), 0.45, atol=1e-12)
    np.testing.assert_allclose(sideways.sum(axis=1), 0, atol=1e-12)


@given(seeds)
def test_metrics_do_not_depend_on_scale_place_or_direction(seed):
    rng = np.random.default_rng(seed)
    space = random_space(rng)
    scaled = moved(space, np.eye(3), rng.normal(size=3), 7.0)
    turned = moved(space, Rotation.random(rng=rng).as_matrix(), rng.normal(size=3), 1.0)
    assert ferrari_canny(scaled) == pytest.approx(ferrari_canny(space), rel=1e-6)
    # The eight edges of a cone turn with the frame, so the pyramid's corners cost a little invariance.
    assert ferrari_canny(turned) == pytest.approx(ferrari_canny(space), rel=0.25)
    for other in (scaled, turned):
        assert isotropy(other) == pytest.approx(isotropy(space), rel=1e-9)
        assert volume(other) == pytest.approx(volume(space), rel=1e-9)


@given(seeds)
def test_isotropy_lies_between_zero_and_one(seed):
    directions = np.random.default_rng(seed).normal(size=(3, 3))
    assert 0 <= isotropy(on_sphere(directions)) <= 1


def test_contacts_in_a_line_resist_no_torque_about_it():
    space = on_sphere([(1, 0, 0), (-1, 0, 0), (1, 0, 0)])
    assert isotropy(space) == pytest.approx(0, abs=1e-12)
    assert volume(space) == pytest.approx(0, abs=1e-12)
    assert ferrari_canny(space) == 0


def test_volume_is_that_of_the_wrench_ellipsoid():
    space = random_space(np.random.default_rng(2))
    G = space.grasp_matrix()
    assert volume(space) == pytest.approx(np.sqrt(np.linalg.det(G @ G.T)))


def test_contacts_on_one_side_hold_nothing():
    assert ferrari_canny(on_sphere([(1, 0.3, 0), (1, -0.3, 0.2), (1, 0, -0.3)])) == 0


def test_three_on_an_equator_hold_and_friction_helps():
    held = [ferrari_canny(equator(friction=friction)) for friction in (0.1, 0.3, 0.6, 1.0, 2.0)]
    assert held[0] > 0
    assert (np.diff(held) > 0).all()


def test_more_fingers_on_the_equator_hold_no_less():
    assert ferrari_canny(equator(6)) >= ferrari_canny(equator(3)) - 1e-12


@settings(max_examples=15)
@given(seeds)
def test_ferrari_canny_is_the_weakest_direction(seed):
    rng = np.random.default_rng(seed)
    space = random_space(rng)
    wrenches = space.cone_wrenches()

    def resisted(directions):
        return (directions @ wrenches.T).max(axis=1)

    def unit(vectors):
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)

    found = ferrari_canny(space)
    directions = unit(rng.normal(size=(5_000, 6)))
    assert found <= resisted(directions).min() + 1e-12
    width = 0.3
    while width > 1e-4:  # narrow in on the weakest directions
        best = directions[np.argsort(resisted(directions))[:20]]
        directions = np.vstack([best, unit(np.repeat(best, 50, axis=0) + width * rng.normal(size=(1_000, 6)))])
        width *= 0.8
    weakest = resisted(directions).min()
    assert found <= weakest + 1e-12
    assert weakest == pytest.approx(found, rel=0.03)


def holding(margin: float) -> Holding:
    return Holding(margin, np.array([0.0, 0.0, -1.0]), np.full(3, 0.6), None)


def test_assessment_states_every_metric():
    space = random_space(np.random.default_rng(3))
    document = assess(GraspState(space, np.array([0.5, 0.7, -0.2, 0.0]), holding(1.5)))
    assert document == {
        "holding_margin": 1.5,
        "quality": 0.5,
        "object_quality": 0.7,
        "manipulability": -0.2,
        "isotropy": isotropy(space),
        "volume": volume(space),
        "ferrari_canny": ferrari_canny(space),
    }


@pytest.mark.parametrize(("margin", "stated"), [(-0.25, -0.25), (-np.inf, None)])
def test_no_margin_at_all_is_none(margin, stated):
    state = GraspState(random_space(np.random.default_rng(3)), np.array([0.5, 0.7, -0.2, 0.0]), holding(margin))
    assert assess(state)["holding_margin"] == stated


def test_every_metric_says_what_it_is():
    known = pathlib.Path(__file__).parents[3].joinpath("REFERENCES.md").read_text()
    for name, metric in available_metrics().items():
        document = metric.to_document()
        assert document["name"] == name == metric.name
        assert document["meaning"].endswith(".")
        assert metric.higher_is_better in (True, False)
        keys = re.findall(r"\b[A-Z]\w+\d{4}\b", metric.source)
        assert keys, metric
        assert all(f"| {key} " in known for key in keys)
