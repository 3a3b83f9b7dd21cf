"""The point grid against brute force and SciPy's KD-tree."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from fingersplit.objects.grid_kernel import build_grid, cell_range, nearest, smooth_directions, thin_evenly

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.integers(1, 300), st.sampled_from([0.02, 0.1, 3.0]))
def test_points_stand_in_the_order_of_their_cells(seed, count, cell):
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * (1, 0.5, 0.1)
    grid, order = build_grid(points, cell)
    np.testing.assert_array_equal(grid.points, points[order])
    assert sorted(order) == list(range(count))
    counts = np.diff(grid.starts)
    assert (grid.starts[0], grid.starts[-1]) == (0, count)
    assert counts.size == np.prod(grid.shape)
    cells = np.repeat(np.arange(counts.size), counts)
    expected = ((grid.points - points.min(axis=0)) / cell).astype(int)
    np.testing.assert_array_equal(np.ravel_multi_index(expected.T, grid.shape), cells)
    assert (np.diff(order)[np.diff(cells) == 0] > 0).all()  # within a cell as they were given


@given(seeds, st.sampled_from([1, 2, 30, 400]), st.sampled_from([0.01, 0.1, 1.0, 30.0]))
def test_nearest_is_that_of_a_kd_tree_near_and_far(seed, count, reach):
    rng = np.random.default_rng(seed)
    (grid, _), queries = build_grid(rng.uniform(-0.1, 0.1, (count, 3)), 0.02), rng.uniform(-reach, reach, (5, 3))
    distances, best = cKDTree(grid.points).query(queries)
    farthest = np.linalg.norm(grid.points - queries[:, None], axis=2).argmax(axis=1)
    for query, distance, good, bad in zip(queries, distances, best, farthest, strict=True):
        for hint in (-1, good, bad, *rng.integers(count, size=3)):
            found = nearest(grid, tuple(query), int(hint))
            assert np.linalg.norm(grid.points[found] - query) == pytest.approx(distance, rel=1e-12)


@given(seeds)
def test_nearest_where_cells_are_empty_and_a_query_stands_on_their_border(seed):
    """Few points in many cells, queries on cell borders and exactly at points."""
    rng = np.random.default_rng(seed)
    grid, _ = build_grid(rng.uniform(-0.1, 0.1, (12, 3)), 0.004)
    tree = cKDTree(grid.points)
    on_borders = np.array(grid.origin) + 0.004 * rng.integers(-5, 60, (6, 3))
    for query in np.vstack([on_borders, grid.points[:3]]):
        for hint in (-1, int(rng.integers(12))):
            found = nearest(grid, tuple(query), hint)
            assert np.linalg.norm(grid.points[found] - query) == pytest.approx(tree.query(query)[0], rel=1e-12)


@pytest.mark.parametrize("name", ["box", "mug"])
def test_nearest_on_a_real_surface(prepared, name):
    grid = prepared(name).surface.grid
    tree, rng = cKDTree(grid.points), np.random.default_rng(0)
    picked = rng.integers(len(grid.points), size=200)
    near = grid.points[picked] + rng.normal(scale=2e-3, size=(200, 3))
    around, far = rng.uniform(-0.3, 0.3, (100, 3)), rng.uniform(-5, 5, (20, 3))
    for query, close in zip(np.vstack([near, around, far]), [*picked, *[-1] * 120], strict=True):
        distance, _ = tree.query(query)
        for hint in (-1, int(close), int(rng.integers(len(grid.points)))):
            found = nearest(grid, tuple(query), hint)
            assert np.linalg.norm(grid.points[found] - query) == pytest.approx(distance, rel=1e-12)


@given(seeds, st.floats(0.001, 0.2))
def test_cells_of_a_ball_hold_every_point_in_it(seed, reach):
    rng = np.random.default_rng(seed)
    (grid, _), query = build_grid(rng.uniform(-0.1, 0.1, (200, 3)), 0.02), rng.uniform(-0.2, 0.2, 3)
    low, high = cell_range(grid, tuple(query), reach)
    members = set()
    for cell in np.ndindex(*np.subtract(high, low)):
        number = np.ravel_multi_index(np.add(low, cell), grid.shape)
        members |= set(range(grid.starts[number], grid.starts[number + 1]))
    inside = np.nonzero(np.linalg.norm(grid.points - query, axis=1) < reach)[0]
    assert set(inside.tolist()) <= members


@given(seeds, st.sampled_from([0.01, 0.05, 0.4]))
def test_thinned_points_keep_their_distance_and_cover_the_rest(seed, spacing):
    points = np.random.default_rng(seed).uniform(0, 0.3, (500, 3))
    chosen = thin_evenly(points, spacing)
    assert chosen[0] == 0  # points are taken in their order
    assert (np.diff(chosen) > 0).all()
    kept = points[chosen]
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
    grid, order = build_grid(points, 0.002)
    noisy, exact = noisy[order], exact[order]
    smooth = smooth_directions(grid, noisy, 0.002, np.cos(np.radians(40)))
    np.testing.assert_allclose(np.linalg.norm(smooth, axis=1), 1, atol=1e-12)
    error = np.degrees(np.arccos(np.clip((smooth * exact).sum(axis=1), -1, 1)))
    before = np.degrees(np.arccos(np.clip((noisy * exact).sum(axis=1), -1, 1)))
    assert np.median(error) < np.median(before) / 2
    assert error.max() < 40
