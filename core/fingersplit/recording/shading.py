"""Meshes as viewers draw them: single precision, with normals that are smooth except across creases."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.recording.raycast import Layer

__all__ = ["ShadedMesh", "shade_hand", "shade_object"]


@dataclass(frozen=True, eq=False)
class ShadedMesh:
    """Vertices (n, 3) [m], unit normals (n, 3) and faces (m, 3) of one body in its own frame."""

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.uint32]


@lru_cache(maxsize=8)
def shade_object(mesh: Mesh) -> ShadedMesh:
    """The object; kept for the next recording of the same one."""
    return _shade(mesh.vertices, mesh.faces)


@lru_cache(maxsize=8)
def shade_hand(hand: Hand) -> tuple[ShadedMesh, ...]:
    """Every collision primitive of a hand."""
    return tuple(_shade(np.asarray(mesh.vertices), np.asarray(mesh.faces)) for mesh in hand.shape_meshes)


def _shade(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> ShadedMesh:
    """A vertex is doubled only where a crease gives it two normals."""
    corner_normals = Layer(vertices, faces, (0.0, 0.0, 0.0, 1.0)).corner_normals.reshape(-1, 3)
    keys = np.column_stack([faces.ravel(), np.round(1e3 * corner_normals)]).astype(np.int64)
    # One number a corner sorts faster than rows do; digits of at most 1000 in base 4096 cannot run into each other.
    numbers = keys @ np.array([1 << 36, 1 << 24, 1 << 12, 1])
    _, first, places = np.unique(numbers, return_index=True, return_inverse=True)
    return ShadedMesh(
        vertices=vertices[faces.ravel()[first]].astype(np.float32),
        normals=corner_normals[first],
        faces=places.reshape(-1, 3).astype(np.uint32),
    )
