"""Meshes as viewers draw them: single precision, with normals that are smooth except across creases."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.recording.looks import hand_looks
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


Array = NDArray[np.float64]

PLAIN = (0.66, 0.69, 0.73)
"""Red, green and blue of what has no look of its own."""
NORMAL_STEPS = 256
"""Normals have components in so many steps from 0 to 1; they turn by less than 0.2 degrees for it."""


@dataclass(frozen=True, eq=False)
class ShadedMesh:
    """Vertices (n, 3) [m], unit normals (n, 3) and faces (m, 3) of one body in its own frame, and its colours.

    Attributes:
        colors: Red, green and blue of every vertex, 0 to 255, (n, 3); None for one colour that others choose.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    faces: NDArray[np.uint32]
    colors: NDArray[np.uint8] | None = None


@lru_cache(maxsize=8)
def shade_object(mesh: Mesh) -> ShadedMesh:
    """The object; kept for the next recording of the same one."""
    return _shade(mesh.vertices, mesh.faces)


@lru_cache(maxsize=8)
def shade_hand(hand: Hand) -> tuple[ShadedMesh, ...]:
    """Every link of a hand, see ``posing.hand_links``, as it looks."""
    carried = _carried_links(hand)
    return tuple(_shaded_link(hand, link, carried) for link in hand_links(hand))


def _carried_links(hand: Hand) -> dict[int, tuple[tuple[int, int], Array]]:
    """For links of the model: finger and joint of the body that carries it, and ``body_from_link`` (4, 4).

    Links without joints hang on the one before them; one that nothing with a shape carries is left out.
    """
    carried: dict[int, tuple[tuple[int, int], Array]] = {}
    for k, shape in enumerate(hand.model.shapes):
        body_from_shape = pose_matrix(hand.arrays.shape_rotations[k], hand.arrays.shape_positions[k])
        body = int(hand.arrays.shape_fingers[k]), int(hand.arrays.shape_links[k])
        carried.setdefault(shape.link, (body, body_from_shape @ np.linalg.inv(shape.pose)))
    for number, link in enumerate(hand.model.links):
        if number not in carried and not link.joints and link.parent in carried:
            body, body_from_parent = carried[link.parent]
            carried[number] = body, body_from_parent @ link.pose
    return carried


def _shaded_link(hand: Hand, link: HandLink, carried: dict[int, tuple[tuple[int, int], Array]]) -> ShadedMesh:
    """Everything that is seen of a body: the looks of its links, and the shapes of what is attached to it."""
    parts: list[tuple[Array, NDArray[np.int64], tuple[float, float, float]]] = []
    for look in hand_looks(hand):
        body, body_from_link = carried.get(look.link, (None, np.eye(4)))
        if body == (link.finger, link.joint):
            parts.append((transform_points(body_from_link, look.vertices), look.faces, look.rgb))
    for k in link.shapes:
        if k >= len(hand.model.shapes) or not parts:
            body_from_shape = pose_matrix(hand.arrays.shape_rotations[k], hand.arrays.shape_positions[k])
            mesh = hand.shape_meshes[k]
            parts.append((transform_points(body_from_shape, mesh.vertices), mesh.faces, PLAIN))
    firsts = np.cumsum([0, *(len(vertices) for vertices, _, _ in parts)])
    faces = np.vstack([corners + first for (_, corners, _), first in zip(parts, firsts, strict=False)])
    colors = np.vstack([np.tile(np.round(255 * np.array(rgb)), (len(vertices), 1)) for vertices, _, rgb in parts])
    return _shade(np.vstack([vertices for vertices, _, _ in parts]), faces, colors.astype(np.uint8))


def _shade(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], colors: NDArray[np.uint8] | None = None
) -> ShadedMesh:
    """Recordings are compressed by bytes that repeat: those of short numbers, and of faces in vertex order, do."""
    corners, vertex_of, normals = shaded_corners(vertices, faces)
    return ShadedMesh(
        vertices=vertices[vertex_of].astype(np.float32),
        normals=(np.round(NORMAL_STEPS * normals) / NORMAL_STEPS).astype(np.float32),
        faces=corners[np.argsort(corners.min(axis=1), kind="stable")].astype(np.uint32),
        colors=None if colors is None else colors[vertex_of],
    )
