"""Supervoxels hang together, face one way, stay on one side of an edge, and cover the surface."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fingersplit.objects.grid_kernel import neighbour_lists
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS, box
from fingersplit.objects.supervoxels import REACH, cluster_supervoxels
from fingersplit.objects.surface import sample_surface

OBJECTS = pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))


@OBJECTS
def test_every_sample_has_a_supervoxel_and_all_have_members(prepared, name):
    model = prepared(name)
    labels, centers, normals = model.supervoxels
    assert labels.shape == (len(model.surface.normals),)
    assert np.array_equal(np.unique(labels), np.arange(len(centers)))
    assert 1_200 < len(centers) < 3_000
    assert normals.shape == centers.shape
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)


@OBJECTS
def test_centers_are_samples_of_their_own_and_near_all_members(prepared, name):
    model = prepared(name)
    labels, centers, _ = model.supervoxels
    distances, which = cKDTree(model.surface.grid.points).query(centers)
    assert distances.max() == 0
    assert np.array_equal(labels[which], np.arange(len(centers)))
    spacing = model.surface.spacing * np.sqrt(len(labels) / 2_000)
    aside = np.linalg.norm(model.surface.grid.points - centers[labels], axis=1)
    assert np.percentile(aside, 99) < 1.5 * spacing
    assert aside.max() < 4 * spacing


@OBJECTS
def test_supervoxels_hang_together(prepared, name):
    model = prepared(name)
    labels, centers, _ = model.supervoxels
    starts, neighbours = neighbour_lists(model.surface.grid, REACH * model.surface.spacing)
    rows = np.repeat(np.arange(len(labels)), np.diff(starts))
    same = labels[rows] == labels[neighbours]
    links = coo_array((np.ones(same.sum()), (rows[same], neighbours[same])), shape=(len(labels),) * 2)
    parts, _ = connected_components(links, directed=False)
    assert parts <= 1.02 * len(centers)  # a better cluster may take a bridge away in the last round


def test_neighbour_lists_are_those_of_a_tree(prepared):
    surface = prepared("mug").surface
    starts, neighbours = neighbour_lists(surface.grid, 2.0 * surface.spacing)
    points = surface.grid.points
    for i, found in enumerate(cKDTree(points).query_ball_point(points[:500], 2.0 * surface.spacing)):
        assert sorted({*found} - {i}) == sorted(neighbours[starts[i] : starts[i + 1]])


def test_no_supervoxel_bends_around_an_edge_of_a_box():
    surface = sample_surface(box((0.05, 0.07, 0.12)))
    labels, _, normals = cluster_supervoxels(surface, 1_000)
    np.testing.assert_allclose((normals[labels] * surface.normals).sum(axis=1), 1, atol=1e-9)


def test_two_sides_of_a_thin_plate_stay_apart():
    surface = sample_surface(box((0.1, 0.1, 0.5e-3)))
    labels, _, normals = cluster_supervoxels(surface, 500)
    flat = np.abs(surface.normals[:, 2]) > 0.99
    assert ((normals[labels] * surface.normals).sum(axis=1)[flat] > 0.99).all()


def test_clusters_follow_curvature(prepared):
    """On a sphere normals differ from the cluster's by no more than its size makes them."""
    model = prepared("sphere")
    labels, _, normals = model.supervoxels
    angles = np.arccos(np.clip((normals[labels] * model.surface.normals).sum(axis=1), -1, 1))
    assert np.percentile(angles, 99) < np.radians(9)


def test_same_surface_gives_the_same_clusters(prepared):
    model = prepared("bottle")
    again = cluster_supervoxels(model.surface, 2_000)
    np.testing.assert_array_equal(again.labels, model.supervoxels.labels)
    np.testing.assert_array_equal(again.centers, model.supervoxels.centers)
