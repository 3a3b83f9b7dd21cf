"""Points of obstacles moved, culled and measured, against NumPy."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fingersplit.scene.points_kernel import bounds_of, least_along, points_within
from fingersplit.transforms import pose_matrix, rotation_from_wxyz, transform_points

numbers = st.floats(-2.0, 2.0, width=32)
clouds = st.integers(1, 40).flatmap(lambda n: arrays(np.float64, (n, 3), elements=numbers))
vectors = arrays(np.float64, 3, elements=numbers)


@given(clouds, vectors, vectors, st.floats(0.0, 3.0))
def test_points_within_reach_are_kept_in_their_order(points, position, center, reach):
    pose = pose_matrix(rotation_from_wxyz((0.8, 0.0, 0.6, 0.0)), position)
    moved = transform_points(pose, points)
    away = np.linalg.norm(moved - center, axis=1)

    kept = points_within(points, pose, center, reach)

    expected = moved[away <= reach]
    if np.abs(away - reach).min() > 1e-9:
        assert np.allclose(kept, expected)


@given(clouds, vectors)
def test_bounds_and_least_coordinates_are_those_of_all_points(points, direction):
    assert (bounds_of(points) == [points.min(axis=0), points.max(axis=0)]).all()
    assert np.isclose(least_along(points, direction), (points @ direction).min())
