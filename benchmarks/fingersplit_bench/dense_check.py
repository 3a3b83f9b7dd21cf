"""Whether a grasp keeps its constraints, by dense points and original shapes: nothing of the planner's own kernels.

Links are sampled on their surfaces; supports and primitives are met by formulas written here, clouds by a tree of the
links' points, links among each other by the half-spaces of their hulls.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.hands.hand import Hand
from fingersplit.planning.run import Run
from fingersplit.scene.shapes import Primitive
from fingersplit.scene.world import Obstacle
from fingersplit.transforms import transform_points

__all__ = ["Excess", "half_spaces", "link_depth", "link_points", "measure_excess"]

POINTS = 600
"""On every link."""


@dataclass(frozen=True)
class Excess:
    """By how much a grasp breaks its constraints [m]; negative where it keeps them with something to spare.

    Attributes:
        support: Clearance that it lacks from a support surface.
        obstacle: The same from obstacles.
        region: How deep a contact lies in a forbidden half-space.
        links: How much deeper than the planner's tolerance two links that may not meet lie in each other.
    """

    support: float
    obstacle: float
    region: float
    links: float

    @property
    def most(self) -> float:
        """The largest of them."""
        return max(self.support, self.obstacle, self.region, self.links)


def measure_excess(run: Run, hand: Hand) -> Excess:
    """Measure one grasp of a plan with a scene."""
    assert run.scene is not None
    scene, final = run.scene.constraints.scene, run.final
    poses = hand.shape_poses(final.joints, final.object_from_palm)
    in_object = [transform_points(pose, points) for pose, points in zip(poses, link_points(hand), strict=True)]
    in_world = transform_points(run.scene.world_from_object, np.concatenate(in_object))
    support = [scene.clearance - (in_world @ one.normal - one.offset).min() for one in scene.support_surfaces]
    obstacle = [scene.clearance - _least_distance(in_world, one) for one in scene.obstacles]
    regions = [
        float(one.offset - (final.contacts @ one.normal).min())
        for one in run.scene.constraints.contact_regions.forbidden
        if one.type == "half_space" and one.normal is not None and one.offset is not None
    ]
    return Excess(
        support=float(max(support, default=-np.inf)),
        obstacle=float(max(obstacle, default=-np.inf)),
        region=max(regions, default=-np.inf),
        links=link_depth(hand, poses, in_object) - float(run.problem.settings.penetration_tolerance),
    )


@lru_cache(maxsize=8)
def link_points(hand: Hand) -> tuple[NDArray[np.float64], ...]:
    """Points on every link, link frame, its corners among them."""
    return tuple(np.vstack([mesh.sample(POINTS, seed=0), mesh.vertices]) for mesh in hand.shape_meshes)


@lru_cache(maxsize=8)
def half_spaces(hand: Hand) -> tuple[NDArray[np.float64], ...]:
    """Outward normals and offsets (m, 4) of every link's hull, link frame; links are convex."""
    found = []
    for mesh in hand.shape_meshes:
        hull = trimesh.Trimesh(mesh.vertices, mesh.faces).convex_hull
        offsets = np.einsum("ij,ij->i", hull.face_normals, hull.triangles[:, 0])
        found.append(np.unique(np.round(np.column_stack([hull.face_normals, offsets]), 9), axis=0))
    return tuple(found)


def _least_distance(points: NDArray[np.float64], obstacle: Obstacle) -> float:
    """Least distance of points (n, 3), scene frame, from an obstacle [m]; negative inside."""
    pose, primitive = obstacle.pose.matrix, obstacle.primitive
    if primitive is not None:
        local = (points - pose[:3, 3]) @ pose[:3, :3]
        return float(_distances(primitive, local).min())
    assert obstacle.points is not None
    cloud = transform_points(pose, obstacle.points)
    return float(cKDTree(points).query(cloud)[0].min()) - obstacle.point_radius


def _distances(primitive: Primitive, local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed distances (n,) of points (n, 3) in a primitive's frame [m]."""
    sizes = primitive.dimensions
    if primitive.type == "sphere":
        return np.asarray(np.linalg.norm(local, axis=1) - sizes[0])
    if primitive.type == "capsule":
        along = np.clip(local[:, 2], -sizes[0] / 2, sizes[0] / 2)
        off = np.column_stack([local[:, :2], local[:, 2] - along])
        return np.asarray(np.linalg.norm(off, axis=1) - sizes[1])
    if primitive.type == "cylinder":
        beyond = np.column_stack([np.linalg.norm(local[:, :2], axis=1) - sizes[1], np.abs(local[:, 2]) - sizes[0] / 2])
    else:
        beyond = np.abs(local) - np.array(sizes) / 2
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))


def link_depth(hand: Hand, poses: list[NDArray[np.float64]], in_object: list[NDArray[np.float64]]) -> float:
    """How deep a point of one link lies in another that it may not meet [m]."""
    most = -np.inf
    spaces = half_spaces(hand)
    middles = np.array([points.mean(axis=0) for points in in_object])
    radii = [np.linalg.norm(points - middle, axis=1).max() for points, middle in zip(in_object, middles, strict=True)]
    for a, b in hand.arrays.pairs[: hand.arrays.pair_count].tolist():
        if np.linalg.norm(middles[a] - middles[b]) > radii[a] + radii[b]:
            continue
        for one, other in ((a, b), (b, a)):
            local = (in_object[one] - poses[other][:3, 3]) @ poses[other][:3, :3]
            heights = local @ spaces[other][:, :3].T - spaces[other][:, 3]
            most = max(most, float(-heights.max(axis=1).min()))
    return most
