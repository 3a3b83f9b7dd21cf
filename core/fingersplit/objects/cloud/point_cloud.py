"""Points measured on an object's surface, by one view or several."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["PointCloud"]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points on the surface of one object, with noise and outliers as the camera left them.

    Attributes:
        points: In the object frame, (n, 3) [m], read-only.
        normals: Outward directions at the points, (n, 3), any length; None where they are not known.
        viewpoint: Where the camera stood, (3,) [m]; None where it is not known, or where views were merged.
        support: Plane that the object stands on: unit normal on its side and offset along it [m], (4,). In a cloud from
            one view the other side is then assumed (`complete`); None where no plane is known or nothing is to be
            assumed.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64] | None = None
    viewpoint: NDArray[np.float64] | None = None
    support: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for name in ("points", "normals", "viewpoint", "support"):
            if getattr(self, name) is not None:
                array = np.array(getattr(self, name), dtype=np.float64, order="C")
                array.setflags(write=False)
                object.__setattr__(self, name, array)

    @property
    def extents(self) -> NDArray[np.float64]:
        """Edge lengths of the axis-aligned bounding box, (3,) [m]."""
        return np.asarray(np.ptp(self.points, axis=0))

    def to_arrays(self) -> dict[str, Any]:
        """What is known, by name, as the arrays of an ``.npz``."""
        parts = {name: getattr(self, name) for name in ("points", "normals", "viewpoint", "support")}
        return {name: part for name, part in parts.items() if part is not None}

    @cached_property
    def content_hash(self) -> str:
        """Hash of all that is known (32 hex digits)."""
        digest = hashlib.sha256(b"cloud")
        for part in (self.points, self.normals, self.viewpoint):
            digest.update(b"none" if part is None else part.astype("<f8").tobytes())
        if self.support is not None:
            digest.update(b"support" + self.support.astype("<f8").tobytes())
        return digest.hexdigest()[:32]
