"""Poses in space, with the standard library alone; numpy arrays come out where numpy is installed.

Names compose: ``world_from_object @ object_from_palm`` is ``world_from_palm``. Lengths are in metres, quaternions
``wxyz``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from fingersplit_client.errors import invalid
from fingersplit_client.schemas import Quaternion, Vector3

__all__ = ["Transform", "TransformLike", "array", "dot", "norm", "subtract"]

_TOLERANCE = 1e-4
"""Most that a rotation matrix may be off, so that matrices in single precision pass."""

Rows = tuple[Vector3, Vector3, Vector3]


@dataclass(frozen=True)
class Transform:
    """A rotation followed by a translation, ``a_from_b``: where frame b stands in frame a.

    Attributes:
        position: Origin of b in a [m].
        wxyz: Rotation of b in a, a unit quaternion.
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    wxyz: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        length = math.hypot(*self.wxyz)
        if len(self.wxyz) != 4 or not math.isfinite(length) or length < 1e-9:
            raise invalid(f"{self.wxyz} is no quaternion wxyz; it must be four numbers, not all zero.")
        if len(self.position) != 3 or not all(map(math.isfinite, self.position)):
            raise invalid(f"{self.position} is no position; it must be three numbers.")
        object.__setattr__(self, "wxyz", tuple(float(part) / length for part in self.wxyz))
        object.__setattr__(self, "position", tuple(map(float, self.position)))

    @classmethod
    def of(cls, pose: "TransformLike") -> "Transform":
        """A transform from whatever says one: a 4x4 matrix, a pair of position and wxyz, or a transform.

        Raises:
            InvalidRequestError: It is none of these, or the matrix has no rotation.
        """
        if isinstance(pose, Transform):
            return pose
        rows = pose.tolist() if hasattr(pose, "tolist") else list(pose)
        if len(rows) == 2:
            return cls(tuple(rows[0]), tuple(rows[1]))
        if len(rows) != 4 or any(len(row) != 4 for row in rows):
            raise invalid("A pose must be a 4x4 matrix, a pair of position and wxyz, or a Transform.")
        return cls._of_matrix([[float(number) for number in row] for row in rows])

    @classmethod
    def _of_matrix(cls, rows: list[list[float]]) -> "Transform":
        rotation = [row[:3] for row in rows[:3]]
        columns = list(zip(*rotation, strict=True))
        unit = all(abs(dot(columns[i], columns[j]) - (i == j)) <= _TOLERANCE for i in range(3) for j in range(i + 1))
        if not unit or dot(_cross(columns[0], columns[1]), columns[2]) < 0 or rows[3] != [0, 0, 0, 1]:
            raise invalid("The upper left of a 4x4 pose must be a rotation, its last row 0 0 0 1.")
        return cls((rows[0][3], rows[1][3], rows[2][3]), _quaternion(rotation))

    @property
    def rotation(self) -> Rows:
        """Rotation matrix, by rows."""
        w, x, y, z = self.wxyz
        return (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )

    @property
    def matrix(self) -> Any:
        """Homogeneous matrix (4, 4): a numpy array where numpy is installed, else nested tuples."""
        rows = [(*row, offset) for row, offset in zip(self.rotation, self.position, strict=True)]
        return array((*rows, (0.0, 0.0, 0.0, 1.0)))

    def rotate(self, direction: Sequence[float]) -> Vector3:
        """A direction of frame b in frame a."""
        x, y, z = (dot(row, direction) for row in self.rotation)
        return x, y, z

    def apply(self, point: Sequence[float]) -> Vector3:
        """A point of frame b in frame a [m]."""
        x, y, z = (a + b for a, b in zip(self.rotate(point), self.position, strict=True))
        return x, y, z

    def inverse(self) -> "Transform":
        """``b_from_a``."""
        w, x, y, z = self.wxyz
        back = Transform(wxyz=(w, -x, -y, -z))
        return Transform(back.rotate([-offset for offset in self.position]), back.wxyz)

    def __matmul__(self, other: "Transform") -> "Transform":
        w, x, y, z = self.wxyz
        v, a, b, c = other.wxyz
        product = (
            w * v - x * a - y * b - z * c,
            w * a + x * v + y * c - z * b,
            w * b - x * c + y * v + z * a,
            w * c + x * b - y * a + z * v,
        )
        return Transform(self.apply(other.position), product)


TransformLike: TypeAlias = Transform | Sequence[Sequence[float]] | Any
"""What `Transform.of` takes."""


def array(values: Any) -> Any:
    """A numpy array where numpy is installed, else the nested tuples as they are."""
    try:
        import numpy as np
    except ImportError:
        return values
    return np.array(values, dtype=float)


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product."""
    return math.fsum(x * y for x, y in zip(a, b, strict=True))


def norm(vector: Sequence[float]) -> float:
    """Length."""
    return math.hypot(*vector)


def subtract(a: Sequence[float], b: Sequence[float]) -> Vector3:
    """``a - b`` of two points."""
    x, y, z = (p - q for p, q in zip(a, b, strict=True))
    return x, y, z


def _cross(a: Sequence[float], b: Sequence[float]) -> Vector3:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _quaternion(r: list[list[float]]) -> Quaternion:
    """Quaternion of a rotation matrix, from its largest component, so that nothing is divided by little."""
    candidates = (
        (1 + r[0][0] + r[1][1] + r[2][2], lambda s: (s, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1])),
        (1 + r[0][0] - r[1][1] - r[2][2], lambda s: (r[2][1] - r[1][2], s, r[1][0] + r[0][1], r[0][2] + r[2][0])),
        (1 - r[0][0] + r[1][1] - r[2][2], lambda s: (r[0][2] - r[2][0], r[1][0] + r[0][1], s, r[2][1] + r[1][2])),
        (1 - r[0][0] - r[1][1] + r[2][2], lambda s: (r[1][0] - r[0][1], r[0][2] + r[2][0], r[2][1] + r[1][2], s)),
    )
    square, components = max(candidates, key=lambda candidate: candidate[0])
    w, x, y, z = components(square)
    return w, x, y, z
