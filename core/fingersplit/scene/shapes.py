"""Poses and primitive shapes of a scene, with the names and dimensions of shape_msgs/SolidPrimitive."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import SceneError
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CYLINDER, SPHERE
from fingersplit.scene.entries import Document, entry
from fingersplit.scene.kinds import Choice, Vector
from fingersplit.transforms import pose_matrix, rotation_from_wxyz, wxyz_from_rotation

__all__ = ["MAX_SIZE", "Pose", "Primitive"]

MAX_SIZE = 100.0
"""[m]; largest dimension of anything in a scene."""

_DIMENSIONS = {
    "box": (BOX, ("x", "y", "z")),
    "sphere": (SPHERE, ("radius",)),
    "cylinder": (CYLINDER, ("height", "radius")),
    "capsule": (CAPSULE, ("height", "radius")),
}


@dataclass(frozen=True)
class Pose(Document):
    """Where a frame stands in another one; the identity when nothing is given."""

    position: tuple[float, float, float] = entry(Vector(), "Origin [m].", (0.0, 0.0, 0.0))
    wxyz: tuple[float, float, float, float] = entry(
        Vector((4,), "1", normalised=True), "Quaternion, w first; normalised when read.", (1.0, 0.0, 0.0, 0.0)
    )

    @cached_property
    def matrix(self) -> NDArray[np.float64]:
        """Homogeneous transform, (4, 4)."""
        matrix = pose_matrix(rotation_from_wxyz(self.wxyz), self.position)
        matrix.setflags(write=False)
        return matrix

    @classmethod
    def from_numbers(cls, numbers: Sequence[float]) -> Self:
        """From seven numbers: position [m] and quaternion."""
        x, y, z, *wxyz = numbers
        return cls((x, y, z), tuple(wxyz))  # type: ignore[arg-type]  # the entry checks how many there are

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Self:
        """From a homogeneous transform (4, 4)."""
        matrix = np.asarray(matrix, dtype=np.float64)
        return cls(matrix[:3, 3].tolist(), wxyz_from_rotation(matrix[:3, :3]).tolist())


@dataclass(frozen=True)
class Primitive(Document):
    """A box, sphere, cylinder or capsule about its own origin; axes of cylinders and capsules are z."""

    type: str = entry(Choice(tuple(_DIMENSIONS)), "What it is: box, sphere, cylinder or capsule.")
    dimensions: tuple[float, ...] = entry(
        Vector((1, 2, 3), "m", 1e-4, MAX_SIZE),
        "Whole lengths [m]: box x, y, z; sphere radius; cylinder and capsule height, radius; a capsule's height "
        "is that of its cylinder, without the caps.",
    )

    def check(self) -> None:
        """As many dimensions as the type has."""
        names = _DIMENSIONS[self.type][1]
        if len(self.dimensions) != len(names):
            raise SceneError(
                "dimensions", f"has {len(self.dimensions)} numbers; a {self.type} has {len(names)}: {', '.join(names)}."
            )

    @property
    def kind(self) -> int:
        """The shape's number in ``hands.shapes``."""
        return _DIMENSIONS[self.type][0]

    @property
    def half_sizes(self) -> NDArray[np.float64]:
        """Sizes as MJCF and ``hands.shapes`` have them: half edges, or radius and half height, (3,) [m]."""
        if self.type == "box":
            return 0.5 * np.array(self.dimensions)
        if self.type == "sphere":
            return np.array([self.dimensions[0], 0.0, 0.0])
        height, radius = self.dimensions
        return np.array([radius, 0.5 * height, 0.0])

    @classmethod
    def box(cls, x: float, y: float, z: float) -> Self:
        """A box with these edges [m]."""
        return cls("box", (x, y, z))

    @classmethod
    def sphere(cls, radius: float) -> Self:
        """A sphere [m]."""
        return cls("sphere", (radius,))

    @classmethod
    def cylinder(cls, height: float, radius: float) -> Self:
        """A cylinder along z [m]."""
        return cls("cylinder", (height, radius))

    @classmethod
    def capsule(cls, height: float, radius: float) -> Self:
        """A capsule along z; ``height`` [m] leaves out the caps."""
        return cls("capsule", (height, radius))

    def to_mujoco(self) -> dict[str, Any]:
        """``type`` and ``size`` of a MuJoCo geom."""
        return {"type": self.kind, "size": self.half_sizes.tolist()}
