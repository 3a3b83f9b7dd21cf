"""How an object comes to rest on a plane."""

from weakref import WeakKeyDictionary

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.poses import compute_stable_poses

from fingersplit.errors import SceneError
from fingersplit.objects.model import ObjectModel

__all__ = ["likeliest_pose", "stable_poses", "standing_pose"]

_known: WeakKeyDictionary[ObjectModel, tuple[NDArray[np.float64], NDArray[np.float64]]] = WeakKeyDictionary()

MAX_HULL_FACES = 2_000
"""Hulls of round objects have ten thousands of faces, each a stable pose of its own."""


def stable_poses(model: ObjectModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Poses in which an object rests on the plane z = 0, its centre of mass over the origin; likeliest first.

    They are computed once for a model, which takes some tenths of a second.

    Returns:
        ``plane_from_object`` (n, 4, 4), and the share of random drops that end in each, (n,) [Goldberg1999].

    Raises:
        SceneError: The object has no pose to rest in.
    """
    found = _known.get(model)
    if found is None:
        found = _known[model] = _compute(model)
    return found


def _compute(model: ObjectModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    hull = model.mesh.trimesh.convex_hull
    if len(hull.faces) > MAX_HULL_FACES:
        hull = _coarse_hull(hull.vertices)
    poses, shares = compute_stable_poses(hull, center_mass=model.center_of_mass)
    if not len(poses):
        raise SceneError("scene.object_pose", "is needed: no stable pose of the object was found.")
    order = np.argsort(-shares, kind="stable")
    poses = np.array(poses)[order]
    for pose in poses:  # the hull may be coarser than the object
        middle = pose[:3, :3] @ model.center_of_mass
        pose[:2, 3] = -middle[:2]
        pose[2, 3] = -(model.mesh.vertices @ pose[2, :3]).min()
    shares = shares[order]
    for array in (poses, shares):
        array.setflags(write=False)
    return poses, shares


def likeliest_pose(model: ObjectModel) -> tuple[NDArray[np.float64], float]:
    """The first of ``stable_poses`` (4, 4), and its share."""
    poses, shares = stable_poses(model)
    return poses[0], float(shares[0])


def standing_pose(model: ObjectModel) -> NDArray[np.float64] | None:
    """Pose on the plane z = 0 as its cloud was seen to stand, (4, 4); None where no support of it is known."""
    if model.support is None:
        return None
    normal, offset = model.support[:3], float(model.support[3])
    level = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    level /= np.linalg.norm(level)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([level, np.cross(normal, level), normal])
    pose[:2, 3] = -(pose[:2, :3] @ model.center_of_mass)
    pose[2, 3] = -offset
    return pose


def _coarse_hull(vertices: NDArray[np.float64]) -> trimesh.Trimesh:
    """Hull of the farthest vertices along evenly spread directions."""
    count = MAX_HULL_FACES // 2
    heights = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angles = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - heights**2)
    directions = np.column_stack([across * np.cos(angles), across * np.sin(angles), heights])
    farthest = np.unique((directions @ vertices.T).argmax(axis=1))
    return trimesh.convex.convex_hull(vertices[farthest])
