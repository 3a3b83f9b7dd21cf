import math
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.transforms import pose_matrix, rotation_from_wxyz
from fingersplit_client import InvalidRequestError, Transform

NUMBERS = st.floats(-10, 10)
QUATERNIONS = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda wxyz: math.hypot(*wxyz) > 0.1)
TRANSFORMS = st.builds(Transform, st.tuples(NUMBERS, NUMBERS, NUMBERS), QUATERNIONS)
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def close(a: Transform, b: Transform) -> bool:
    return bool(np.allclose(a.matrix, b.matrix, atol=1e-9))


@given(TRANSFORMS)
def test_the_matrix_is_the_planners(a: Transform) -> None:
    np.testing.assert_allclose(
        a.matrix, pose_matrix(rotation_from_wxyz(np.array(a.wxyz)), np.array(a.position)), atol=1e-12
    )


@given(TRANSFORMS, TRANSFORMS, TRANSFORMS)
def test_transforms_are_a_group(a: Transform, b: Transform, c: Transform) -> None:
    assert close((a @ b) @ c, a @ (b @ c))
    assert close(a @ a.inverse(), Transform())
    assert close(a @ Transform(), a)
    np.testing.assert_allclose((a @ b).matrix, a.matrix @ b.matrix, atol=1e-9)


@given(TRANSFORMS, POINTS)
def test_points_and_directions_go_with_the_frame(a: Transform, point: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(a.apply(point), a.matrix[:3, :3] @ point + a.matrix[:3, 3], atol=1e-9)
    np.testing.assert_allclose(a.rotate(point), a.matrix[:3, :3] @ point, atol=1e-9)


@given(TRANSFORMS)
def test_a_matrix_gives_its_transform_back(a: Transform) -> None:
    for given_as in (a, a.matrix, a.matrix.tolist(), (a.position, a.wxyz), a.matrix.astype(np.float32)):
        np.testing.assert_allclose(Transform.of(given_as).matrix, a.matrix, atol=1e-5)


@pytest.mark.parametrize(
    "pose",
    [
        np.zeros((4, 4)),
        np.diag([1, 1, -1, 1]),
        np.diag([2, 2, 2, 1]),
        np.eye(3),
        [[1, 0, 0, 0]] * 4,
        ((0, 0), (1, 0, 0, 0)),
    ],
)
def test_what_is_no_pose_is_refused(pose: object) -> None:
    with pytest.raises(InvalidRequestError, match=r"4x4|position"):
        Transform.of(pose)


def test_no_rotation_is_refused() -> None:
    with pytest.raises(InvalidRequestError, match="quaternion"):
        Transform(wxyz=(0.0, 0.0, 0.0, 0.0))
    with pytest.raises(InvalidRequestError, match="position"):
        Transform((math.nan, 0.0, 0.0))


def test_without_numpy_matrices_are_tuples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    assert Transform((1.0, 2.0, 3.0)).matrix == (
        (1.0, 0.0, 0.0, 1.0),
        (0.0, 1.0, 0.0, 2.0),
        (0.0, 0.0, 1.0, 3.0),
        (0.0, 0.0, 0.0, 1.0),
    )
