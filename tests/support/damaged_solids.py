"""Solids of known volume, damaged as meshes in the wild are, for tests of what they enclose."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import trimesh

from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS

__all__ = ["DAMAGES", "DamagedSolid", "damaged_solid"]


class DamagedSolid(NamedTuple):
    """A triangle soup and what it should enclose.

    Attributes:
        vertices: (n, 3) [m].
        faces: (m, 3).
        volume: Of the solid before it was damaged [m^3].
        center: Its centre of mass, (3,) [m].
        kind: The solid and the damages.
    """

    vertices: np.ndarray
    faces: np.ndarray
    volume: float
    center: np.ndarray
    kind: str


Soup = tuple[np.ndarray, np.ndarray]


def _opened(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Soup:
    """Up to 5 % of the surface gone, in one to six patches about random faces."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    areas, middles = mesh.area_faces, mesh.triangles_center
    patches = int(rng.integers(1, 7))
    keep = np.ones(len(faces), bool)
    for seed in rng.choice(len(faces), patches, p=areas / areas.sum()):
        nearest = np.argsort(np.linalg.norm(middles - middles[seed], axis=1))
        nearest = nearest[mesh.face_normals[nearest] @ mesh.face_normals[seed] > 0.5]
        keep[nearest[np.cumsum(areas[nearest]) <= 0.05 * areas.sum() / patches]] = False
    return vertices, faces[keep]


def _pinholed(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Soup:
    return vertices, np.delete(faces, rng.choice(len(faces), int(rng.integers(1, 6)), replace=False), axis=0)


def _doubled(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Soup:
    """Some or all faces twice, on vertices of their own that are a hair away."""
    again = faces if rng.random() < 0.5 else faces[rng.random(len(faces)) < 0.3]
    moved = vertices + rng.normal(scale=1e-9, size=vertices.shape)
    return np.vstack([vertices, moved]), np.vstack([faces, again + len(vertices)])


def _flipped(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Soup:
    """Patches wound the wrong way round, and single faces."""
    middles = vertices[faces].mean(axis=1)
    wrong = rng.random(len(faces)) < 0.05
    for seed in rng.choice(len(faces), 3):
        wrong[np.argsort(np.linalg.norm(middles - middles[seed], axis=1))[: len(faces) // 8]] = True
    return vertices, np.where(wrong[:, None], faces[:, ::-1], faces)


def _unmerged(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Soup:
    """Every triangle with vertices of its own, in any order, as STL has them."""
    faces = faces[rng.permutation(len(faces))]
    return vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


DAMAGES: dict[str, Callable[[np.ndarray, np.ndarray, np.random.Generator], Soup]] = {
    "opened": _opened,
    "pinholed": _pinholed,
    "doubled": _doubled,
    "flipped": _flipped,
    "unmerged": _unmerged,
}


def damaged_solid(number: int) -> DamagedSolid:
    """One of any number of damaged solids, the same every time."""
    rng = np.random.default_rng(number)
    names = sorted(PARAMETRIC_OBJECTS)
    name = names[number % len(names)]
    solid = PARAMETRIC_OBJECTS[name]()
    vertices, faces = np.array(solid.vertices), np.array(solid.faces)
    volume, center = solid.trimesh.volume, solid.trimesh.center_mass
    kind = [name]
    if rng.random() < 0.4:
        vertices, faces, volume, center, how = _with_another(solid, rng)
        kind.append(how)
    for damage in rng.choice(sorted(DAMAGES), int(rng.integers(1, 4)), replace=False):
        vertices, faces = DAMAGES[damage](vertices, faces, rng)
        kind.append(str(damage))
    return DamagedSolid(vertices, faces, volume, center, " ".join(kind))


def _with_another(solid: Mesh, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float, np.ndarray, str]:
    """A solid and a copy of it: away along an axis with a known overlap, or touching in an edge or a point."""
    low, high = solid.bounds
    if rng.random() < 0.5:
        shift, how = (high - low) * np.array([1.0, float(rng.integers(0, 2)), 1.0]), "touched"
        overlap, overlap_center = 0.0, np.zeros(3)
    else:
        shift, how = np.zeros(3), "overlapped"
        overlap, overlap_center = 0.0, np.zeros(3)
        reach = rng.uniform(0.3, 0.8)
        size = np.array([0.05, 0.07, 0.12])
        brick = PARAMETRIC_OBJECTS["box"]()
        assert np.allclose(brick.extents, size)
        solid, (low, high) = brick, brick.bounds
        shift[0] = reach * size[0]
        overlap = (1 - reach) * size.prod()
        overlap_center = (low + high) / 2 + shift / 2
    volume, center = solid.trimesh.volume, solid.trimesh.center_mass
    total = 2 * volume - overlap
    middle = (volume * center + volume * (center + shift) - overlap * overlap_center) / total
    vertices = np.vstack([solid.vertices, solid.vertices + shift])
    return vertices, np.vstack([solid.faces, solid.faces + len(solid.vertices)]), total, middle, how
