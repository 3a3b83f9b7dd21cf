"""The point grid against brute force and SciPy's KD-tree."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from fingersplit.objects.grid import build_grid, cell_range, nearest, smooth_directions, thin_evenly

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(1, 300), st.sampled_from([0.02, 0.1, 3.0]))
def test_every_point_stands_in_its_cell(seed, count, cell):
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * (1, 0.5, 0.1)
    grid = build_grid(points, cell)
    assert sorted(grid.members) == list(range(count))
    counts = np.diff(grid.starts)
    assert counts.sum() == count
    cells = np.repeat(np.arange(counts.size), counts)
    expected = ((points[grid.members] - points.min(axis=0)) / cell).astype(int)
    np.testing.assert_array_equal(np.ravel_multi_index(expected.T, grid.shape), cells)


@given(seeds, st.sampled_from([1, 2, 30, 400]), st.sampled_from([0.01, 0.1, 1.0, 30.0]))
def test_nearest_is_that_of_a_kd_tree_near_and_far(seed, count, reach):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.1, 0.1, (count, 3))
    grid, tree = build_grid(points, 0.02), cKDTree(points)
    for query in rng.uniform(-reach, reach, (5, 3)):
        for hint in (-1, *rng.integers(count, size=3)):
            found = nearest(grid, tuple(query), int(hint))
            assert np.linalg.norm(points[found] - query) == pytest.approx(tree.query(query)[0], rel=1e-12)


def test_nearest_on_a_real_surface(prepared):
    grid = prepared("mug").surface.grid
    tree, rng = cKDTree(grid.points), np.random.default_rng(0)
    on_surface = grid.points[rng.integers(len(grid.points), size=200)] + rng.normal(scale=2e-3, size=(200, 3))
    for query in np.vstack([on_surface, rng.uniform(-0.3, 0.3, (100, 3))]):
        distance, _ = tree.query(query)
        for hint in (-1, int(rng.integers(len(grid.points)))):
            found = nearest(grid, tuple(query), hint)
            assert np.linalg.norm(grid.points[found] - query) == pytest.approx(distance, rel=1e-12)


@given(seeds, st.floats(0.001, 0.2))
def test_cells_of_a_ball_hold_every_point_in_it(seed, reach):
    rng = np.random.default_rng(seed)
    points, query = rng.uniform(-0.1, 0.1, (200, 3)), rng.uniform(-0.2, 0.2, 3)
    grid = build_grid(points, 0.02)
    low, high = cell_range(grid, tuple(query), reach)
    members = set()
    for cell in np.ndindex(*np.subtract(high, low)):
        number = np.ravel_multi_index(np.add(low, cell), grid.shape)
        members |= set(grid.members[grid.starts[number] : grid.starts[number + 1]].tolist())
    inside = np.nonzero(np.linalg.norm(points - query, axis=1) < reach)[0]
    assert set(inside.tolist()) <= members


@given(seeds, st.sampled_from([0.01, 0.05, 0.4]))
def test_thinned_points_keep_their_distance_and_cover_the_rest(seed, spacing):
    points = np.random.default_rng(seed).uniform(0, 0.3, (500, 3))
    kept = points[thin_evenly(points, spacing)]
    if len(kept) > 1:
        assert cKDTree(kept).query(kept, k=2)[0][:, 1].min() >= spacing
    assert cKDTree(kept).query(points)[0].max() < spacing


def test_directions_are_smoothed_but_not_across_a_sharp_edge():
    rng = np.random.default_rng(0)
    across = rng.uniform(-0.01, 0.01, (2000, 2))
    # A roof: flat for x < 0, falling away by 60 degrees for x > 0; noise of 10 degrees on the directions.
    slope = np.where(across[:, 0] < 0, 0.0, np.radians(60))
    points = np.column_stack([across[:, 0] * np.cos(slope), across[:, 1], -np.abs(across[:, 0]) * np.sin(slope)])
    exact = np.column_stack([np.sin(slope), np.zeros(2000), np.cos(slope)])
    noisy = exact + rng.normal(scale=np.radians(10) / np.sqrt(2), size=exact.shape)
    noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
    smooth = smooth_directions(build_grid(points, 0.002), noisy, 0.002, np.cos(np.radians(40)))
    np.testing.assert_allclose(np.linalg.norm(smooth, axis=1), 1, atol=1e-12)
    error = np.degrees(np.arccos(np.clip((smooth * exact).sum(axis=1), -1, 1)))
    before = np.degrees(np.arccos(np.clip((noisy * exact).sum(axis=1), -1, 1)))
    assert np.median(error) < np.median(before) / 2
    assert error.max() < 40
