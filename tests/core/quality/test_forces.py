"""Forces that carry the object: balance, cones, and None where nothing can carry it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.quality.forces import GRAVITY, holding_forces
from fingersplit.quality.metrics import WrenchSpace

RADIUS = 0.04
seeds = st.integers(0, 2**32 - 1)


def on_sphere(directions, friction: float = 0.6) -> WrenchSpace:
    directions = np.asarray(directions, dtype=float)
    normals = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return WrenchSpace(RADIUS * normals, normals, friction, np.zeros(3), RADIUS)


def around(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    angles = 2 * np.pi * np.arange(3) / 3 + rng.uniform(-0.2, 0.2, 3)
    return [(np.cos(a), np.sin(a), z) for a, z in zip(angles, rng.uniform(-0.15, 0.15, 3), strict=True)]


@given(seeds)
def test_forces_balance_the_weight_inside_the_cones(seed):
    space, mass = on_sphere(around(np.random.default_rng(seed))), 0.3
    forces = holding_forces(space, mass)
    assert forces is not None
    resultant = forces.sum(axis=0)
    assert np.linalg.norm(resultant) == pytest.approx(mass * GRAVITY)
    assert np.abs(resultant).max() == pytest.approx(mass * GRAVITY)  # against gravity along one of the axes
    torque = np.cross(space.contacts - space.center, forces).sum(axis=0)
    np.testing.assert_allclose(torque, 0, atol=1e-9)
    normal_parts = -np.einsum("fc,fc->f", forces, space.normals)
    sideways = np.linalg.norm(forces + normal_parts[:, None] * space.normals, axis=1)
    assert (normal_parts >= -1e-12).all()
    assert (sideways <= space.friction * normal_parts + 1e-9).all()


def test_forces_grow_with_the_mass():
    space = on_sphere(around(np.random.default_rng(0)))
    np.testing.assert_allclose(holding_forces(space, 0.4), 2 * holding_forces(space, 0.2), atol=1e-9)


def test_worst_direction_needs_the_least_largest_normal_force():
    # Straight across the plane of three even contacts only friction carries: each passes a third of the weight.
    angles = 2 * np.pi * np.arange(3) / 3
    space = on_sphere(np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1), friction=0.2)
    forces = holding_forces(space, 0.3)
    np.testing.assert_allclose(np.abs(forces[:, 2]), 0.3 * GRAVITY / 3, rtol=1e-6)
    least = 0.3 * GRAVITY / 3 / 0.2
    normal_parts = -np.einsum("fc,fc->f", forces, space.normals)
    assert least <= normal_parts.max() * (1 + 1e-9)
    assert normal_parts.max() < 1.1 * least  # eight edges stand inside the round cone


@pytest.mark.parametrize("directions", [[(1, 0.3, 0), (1, -0.3, 0.2), (1, 0, -0.3)], [(1, 0, 0), (1, 0, 0), (1, 0, 0)]])
def test_no_forces_where_nothing_opposes(directions):
    assert holding_forces(on_sphere(directions), 0.3) is None


def test_no_forces_where_the_weight_tips_the_object():
    across = on_sphere([(1, 0, 0), (-1, 0, 0), (-1, 0, 0)])
    assert holding_forces(across, 0.3) is not None
    beside = dataclasses.replace(across, center=np.array([0, 0.02, 0]))
    assert holding_forces(beside, 0.3) is None
