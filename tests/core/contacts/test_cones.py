"""Friction cones and grasp matrix: the definitions that margins, grips, metrics and parallel grasps share."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.contacts.cone_kernel import FACETS, INSCRIBED
from fingersplit.contacts.cones import cone_cosine, cone_edges, facet_directions
from fingersplit.contacts.grasp_matrix import grasp_matrix

seeds = st.integers(0, 2**32 - 1)


def normals_of(seed: int) -> np.ndarray:
    normals = np.random.default_rng(seed).normal(size=(4, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@given(seeds)
def test_facets_look_evenly_all_around_the_normal(seed):
    normals = normals_of(seed)
    directions = facet_directions(normals)
    np.testing.assert_allclose(np.einsum("fek,fk->fe", directions, normals), 0, atol=1e-12)
    turns = np.einsum("fek,fek->fe", directions, np.roll(directions, 1, axis=1))
    np.testing.assert_allclose(turns, np.cos(2 * np.pi / FACETS), atol=1e-12)


@given(seeds, st.floats(0.05, 2.0))
def test_edges_lie_on_the_cone_and_the_inscribed_facets_pass_through_them(seed, friction):
    normals = normals_of(seed)
    edges, directions = cone_edges(normals, friction), facet_directions(normals)
    pressing = -np.einsum("fek,fk->fe", edges, normals)
    sizes = np.linalg.norm(edges, axis=2)
    np.testing.assert_allclose(pressing / sizes, cone_cosine(friction), atol=1e-12)
    # A facet that looks between two edges, turned by half a step, touches both.
    between = directions + np.roll(directions, -1, axis=1)
    between /= np.linalg.norm(between, axis=2, keepdims=True)
    np.testing.assert_allclose(np.einsum("fek,fek->fe", between, edges), INSCRIBED * friction, atol=1e-12)


@given(seeds)
def test_grasp_matrix_of_many_grasps_is_force_and_torque_of_each(seed):
    rng = np.random.default_rng(seed)
    contacts, center, forces = rng.normal(size=(3, 4, 3)), rng.normal(size=3), rng.normal(size=(4, 3))
    matrices = grasp_matrix(contacts, center, 0.5)
    assert matrices.shape == (3, 6, 12)
    for one, points in zip(matrices, contacts, strict=True):
        wrench = one @ forces.ravel()
        np.testing.assert_allclose(wrench[:3], forces.sum(axis=0), atol=1e-12)
        np.testing.assert_allclose(0.5 * wrench[3:], np.cross(points - center, forces).sum(axis=0), atol=1e-12)
        np.testing.assert_array_equal(one, grasp_matrix(points, center, 0.5))


def test_half_angle_of_a_cone():
    assert cone_cosine(1.0) == pytest.approx(np.cos(np.pi / 4))
