"""Meshes as viewers draw them: single precision, with normals that are smooth except across creases."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.recording.posing import HandLink, hand_links
from fingersplit.recording.shading_kernel import corners_of_vertices, smooth_patches, split_vertices
from fingersplit.transforms import pose_matrix, transform_points

__all__ = ["CREASE", "ShadedMesh", "shade_hand", "shade_object", "shaded_corners"]

CREASE = 0.6
"""Faces that meet at a larger angle keep a sharp edge between them [rad]."""


def shaded_corners(
    vertices: NDArray[np.floating], faces: NDArray[np.integer]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Vertices as they are drawn: one for every patch of faces that meets smoothly at a vertex.

    Args:
        vertices: Corner points, (n, 3) [m].
        faces: Vertex indices, counter-clockwise seen from outside, (m, 3).

    Returns:
        The faces by drawn vertices (m, 3), the vertex that each of those stands for (k,), in ascending order, and its
        unit outward normal (k, 3): the mean of its patch's faces by area, zero where they have none.
    """
    vertices, faces = np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.int64)
    starts, corners = corners_of_vertices(faces, len(vertices))
    areas, units = np.empty(faces.shape), np.empty(faces.shape)
    patches = smooth_patches(vertices, faces, starts, corners, math.cos(CREASE), areas, units)
    drawn, vertex_of, normals = split_vertices(faces, starts, corners, patches, areas)
    return drawn, vertex_of, normals


NORMAL_STEPS = 256
"""Normals have components in so many steps from 0 to 1; they turn by less than 0.2 degrees for it."""


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
    """Every link of a hand, see ``posing.hand_links``, with all shapes that it carries."""
    return tuple(_shade(*_link_mesh(hand, link)) for link in hand_links(hand))


def _link_mesh(hand: Hand, link: HandLink) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) [m] in the link's frame and faces (m, 3)."""
    vertices, faces, count = [], [], 0
    for shape in link.shapes:
        link_from_shape = pose_matrix(hand.arrays.shape_rotations[shape], hand.arrays.shape_positions[shape])
        vertices.append(transform_points(link_from_shape, hand.shape_meshes[shape].vertices))
        faces.append(hand.shape_meshes[shape].faces + count)
        count += len(vertices[-1])
    return np.vstack(vertices), np.vstack(faces)


def _shade(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> ShadedMesh:
    """Recordings are compressed by bytes that repeat: those of short numbers, and of faces in vertex order, do."""
    corners, vertex_of, normals = shaded_corners(vertices, faces)
    return ShadedMesh(
        vertices=vertices[vertex_of].astype(np.float32),
        normals=(np.round(NORMAL_STEPS * normals) / NORMAL_STEPS).astype(np.float32),
        faces=corners[np.argsort(corners.min(axis=1), kind="stable")].astype(np.uint32),
    )
