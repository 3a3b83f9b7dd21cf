"""How a hand looks: the visual meshes of its links, light enough to draw many times."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.extras import extra
from fingersplit.hands.forward import link_poses
from fingersplit.hands.hand import Hand
from fingersplit.hands.model import Solid
from fingersplit.hands.shapes import shape_mesh
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CYLINDER, SPHERE
from fingersplit.transforms import transform_points

with extra("pictures"):
    import fast_simplification

__all__ = ["LinkLook", "hand_looks", "light_mesh", "posed_looks"]

Array = NDArray[np.float64]

MAX_FACES, MIN_FACES = 14_000, 60
"""Of all visual meshes of a hand together, and of one of them however small its share is."""
MIN_OPACITY = 0.05
"""Geoms below are there for sensors and markers."""


@dataclass(frozen=True, eq=False)
class LinkLook:
    """All that is seen of a link in one colour.

    Attributes:
        link: Index of the link in the hand's model.
        rgb: Red, green and blue, 0 to 1.
        vertices: Corners in the link's frame, (n, 3) [m].
        faces: Vertex indices, counter-clockwise from outside, (m, 3).
    """

    link: int
    rgb: tuple[float, float, float]
    vertices: Array
    faces: NDArray[np.int64]


@lru_cache(maxsize=8)
def hand_looks(hand: Hand) -> tuple[LinkLook, ...]:
    """What is seen of every link: the model's visual geoms, the collision shapes where it has none."""
    visuals = [solid for solid in hand.model.visuals if solid.color[3] >= MIN_OPACITY] or list(hand.model.solids)
    meshes = [_solid_mesh(solid) for solid in visuals]
    total = sum(len(faces) for solid, (_, faces) in zip(visuals, meshes, strict=True) if solid.vertices is not None)
    groups: dict[tuple[int, tuple[float, ...]], list[tuple[Array, NDArray[np.int64]]]] = {}
    for solid, (vertices, faces) in zip(visuals, meshes, strict=True):
        if solid.vertices is not None:
            vertices, faces = light_mesh(vertices, faces, max(MIN_FACES, len(faces) * MAX_FACES // max(total, 1)))
        key = solid.link, tuple(round(float(part), 3) for part in solid.color[:3])
        groups.setdefault(key, []).append((transform_points(solid.pose, vertices), faces))
    return tuple(_joined(link, (rgb[0], rgb[1], rgb[2]), parts) for (link, rgb), parts in groups.items())


def posed_looks(hand: Hand, joints: Array) -> list[tuple[LinkLook, Array]]:
    """Every look with its vertices in the palm frame (n, 3) [m] at joint angles (N,) [rad]."""
    poses = link_poses(hand.model, joints)
    return [(look, transform_points(poses[look.link], look.vertices)) for look in hand_looks(hand)]


def light_mesh(vertices: Array, faces: NDArray[np.int64], most: int) -> tuple[Array, NDArray[np.int64]]:
    """The mesh with at most about so many faces, by quadric edge collapse [Garland1997]."""
    if len(faces) <= most:
        return vertices, faces
    points, triangles = fast_simplification.simplify(
        vertices.astype(np.float32), faces.astype(np.int32), target_count=most, agg=7
    )
    return np.asarray(points, np.float64), np.asarray(triangles, np.int64)


def _solid_mesh(solid: Solid) -> tuple[Array, NDArray[np.int64]]:
    """A geom as a mesh in its own frame; a mesh's equal vertices are joined, so that it can be simplified."""
    if solid.vertices is not None and solid.faces is not None:
        mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
        mesh.merge_vertices(merge_norm=True, merge_tex=True)
    elif solid.kind == CAPSULE:  # round enough with smooth normals, and a third of what `shape_mesh` takes
        mesh = trimesh.creation.capsule(height=2 * solid.size[1], radius=solid.size[0], count=[12, 20])
    elif solid.kind in (CYLINDER, BOX):
        mesh = shape_mesh(solid.kind, solid.size)
    else:
        mesh = trimesh.creation.icosphere(subdivisions=2)
        mesh.apply_scale(solid.size[0] if solid.kind == SPHERE else solid.size)
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def _joined(link: int, rgb: tuple[float, float, float], parts: list[tuple[Array, NDArray[np.int64]]]) -> LinkLook:
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = np.vstack([faces + first for (_, faces), first in zip(parts, firsts, strict=False)])
    return LinkLook(link, rgb, np.vstack([vertices for vertices, _ in parts]), faces)
