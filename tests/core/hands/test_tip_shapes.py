"""Fingertips keep the shape of their hulls: what touches through a pad must not count as a collision beside it."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from fingersplit.hands.collision_shapes import convex_solids, planning_shapes
from fingersplit.hands.fingers import Pad
from fingersplit.hands.fitting import fit_primitive, primitive_points
from fingersplit.hands.limits import MAX_PLANES
from fingersplit.hands.model import Link, Solid
from fingersplit.hands.self_collision import self_collision_pairs
from fingersplit.hands.shapes import covering_spheres, shape_mesh
from fingersplit.hands.shapes_kernel import CONVEX, shape_distance, shape_distance_gradient
from fingersplit.hands.tip_shapes import convex_fit, stand_out
from fingersplit.scene.convex_kernel import GJK_ROWS, shape_to_shape
from fingersplit.transforms import transform_points

DOME = trimesh.creation.capsule(height=0.02, radius=0.009, count=[20, 20]).vertices
PAD = Pad(0, np.array([0.0, 0.0, 0.02]), np.array([0.8, 0.0, 0.6]), 0.009, None)


@pytest.fixture(scope="module")
def dome():
    return convex_fit(DOME, (PAD,))


def test_convex_solid_contains_the_points_and_hardly_more(dome):
    assert dome.kind == CONVEX
    assert dome.size[0] <= MAX_PLANES
    local = DOME - dome.pose[:3, 3]
    assert max(shape_distance(dome.kind, dome.size, *point) for point in local) < 1e-6
    assert dome.volume < 1.06 * ConvexHull(DOME).volume


def test_it_stands_out_beside_the_pad_less_than_the_smallest_primitive(dome):
    corners = transform_points(dome.pose, primitive_points(dome.kind, dome.size))
    box = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.009, 0.009, 0.019]
    assert stand_out(corners, (PAD,)) < 0.6e-3
    assert stand_out(box + np.array([0, 0, 0.01]), (PAD,)) > 2e-3


def test_distance_has_the_slope_that_is_told(dome):
    rng = np.random.default_rng(0)
    for point in rng.normal(scale=0.012, size=(200, 3)):
        gradient = np.array(shape_distance_gradient(dome.kind, dome.size, tuple(point)))
        assert np.linalg.norm(gradient) == pytest.approx(1.0)
        moved = shape_distance(dome.kind, dome.size, *(point + 1e-9 * gradient))
        assert moved - shape_distance(dome.kind, dome.size, *point) == pytest.approx(1e-9, rel=1e-4)


def test_covering_spheres_and_drawing_are_about_the_same_solid(dome):
    centers, radius, insides = covering_spheres(dome.kind, dome.size)
    mesh = shape_mesh(dome.kind, dome.size)
    points = np.vstack([mesh.vertices, mesh.sample(500, seed=0)])
    assert (np.linalg.norm(points[:, None] - centers, axis=2).min(axis=1) <= radius + 1e-9).all()
    for center, inside in zip(centers, insides, strict=True):
        assert shape_distance(dome.kind, dome.size, *center) <= -inside + 1e-12
    assert mesh.volume == pytest.approx(dome.volume, rel=1e-6)


def test_two_convex_solids_are_as_far_apart_as_they_are(dome):
    rows, turned = np.zeros((GJK_ROWS, 3)), trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
    one = (dome.kind, dome.size, np.eye(3), (0.0, 0.0, 0.0))
    for gap in (0.004, -0.003):
        far = primitive_points(dome.kind, dome.size)[:, 0].max()
        near = (primitive_points(dome.kind, dome.size) @ turned.T)[:, 0].min()
        center = (far - near + gap, 0.0, 0.0)
        distance, _, _ = shape_to_shape(*one, dome.kind, dome.size, turned, center, 0.05, rows)
        if gap > 0:
            assert gap - 1e-5 <= distance < gap + 0.01
        else:
            assert distance < 0


@given(seed=st.integers(0, 2**32 - 1))
def test_depth_of_two_convex_solids_is_hardly_more_than_the_shortest_way_out(dome, seed):
    """The shortest way out is exact from the hull of all differences of corners."""
    rng = np.random.default_rng(seed)
    corners, rows = primitive_points(dome.kind, dome.size), np.zeros((GJK_ROWS, 3))
    one, other = Rotation.from_quat(rng.normal(size=(2, 4))).as_matrix()
    away = rng.normal(size=3)
    away /= np.linalg.norm(away)
    reach = (corners @ one.T @ away).max() - (corners @ other.T @ away).min()
    center = (reach - rng.uniform(0.5e-3, 2e-3)) * away
    differences = ((corners @ other.T + center)[:, None] - corners @ one.T).reshape(-1, 3)
    shortest = -ConvexHull(differences).equations[:, 3].max()
    place = (0.0, 0.0, 0.0), dome.kind, dome.size, other, tuple(center.tolist())
    distance, _, _ = shape_to_shape(dome.kind, dome.size, one, *place, 0.05, rows)
    if shortest > 1e-5:
        assert shortest - 1e-5 <= -distance < shortest + 0.5e-3
    else:
        assert distance > -0.5e-3


def hand_of_solids(solids: tuple[Solid, ...], pads: tuple[Pad, ...]) -> tuple:
    link = Link("tip", -1, np.eye(4), (), 0.1, np.zeros(3), np.eye(3))
    return planning_shapes(convex_solids(solids), (link,), None, pads)


def test_links_with_a_pad_keep_their_hull_and_others_get_primitives():
    mesh = trimesh.convex.convex_hull(DOME)
    solid = Solid("dome", 0, 7, np.zeros(3), np.eye(4), np.ones(4), np.array(mesh.vertices), np.array(mesh.faces))
    assert [shape.kind for shape in hand_of_solids((solid,), (PAD,))] == [CONVEX]
    plain = hand_of_solids((solid,), ())
    assert all(shape.kind != CONVEX for shape in plain)
    assert len(plain) == 1
    assert plain[0].kind == fit_primitive(DOME).kind


def test_no_pair_of_barrett_is_left_out_for_fitted_shapes(barrett):
    """Its shapes are the model's own, so every pair that can meet is tested."""
    assert len(self_collision_pairs(barrett.model)) == barrett.arrays.pair_count == 58
