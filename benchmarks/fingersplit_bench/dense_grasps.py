"""Section `dense_grasps`: feasible grasps against dense points and all triangles, without the planner's kernels."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.run import Run
from fingersplit.planning.search import find_grasps
from fingersplit.transforms import transform_points
from fingersplit_bench.calls import SEED
from fingersplit_bench.dense_check import half_spaces, link_depth, link_points
from fingersplit_bench.suite import Bench, Chapter, table

__all__ = ["DenseObject", "GraspsOfObject", "dense_grasps_chapter", "measure_grasp"]

POINTS = 200_000
"""On every object."""
MAX_DEPTH, MAX_PAD_ANGLE = 1e-3, 0.65
"""What a feasible grasp may not exceed: links in the object or in each other [m], pads touching off their middle
[rad]."""
ACCURACY = 1e-5
"""Of the planner's own exact depth, which stops there [m]."""


@dataclass(frozen=True)
class GraspsOfObject:
    """Figures of one object.

    Attributes:
        name: Of the object.
        grasps: Feasible grasps that were looked at.
        in_object: Those with a link in the object by more than ``MAX_DEPTH``.
        in_links: Those with a link in another one by more than that.
        tilted: Those with a pad that touches more than ``MAX_PAD_ANGLE`` off its middle.
        depth: Deepest of any in the object [m].
        link_depth: Deepest of any link in another [m].
        pad_angle: Largest angle of any pad [rad].
    """

    name: str
    grasps: int
    in_object: int
    in_links: int
    tilted: int
    depth: float
    link_depth: float
    pad_angle: float


class DenseObject:
    """Points all over a mesh, and its triangles.

    Attributes:
        points: On the surface, (n, 3) [m].
        tree: Of these.
    """

    def __init__(self, model: ObjectModel) -> None:
        mesh = trimesh.Trimesh(model.mesh.vertices, model.mesh.faces, process=False)
        self.points = trimesh.sample.sample_surface(mesh, POINTS, seed=0)[0]
        self.tree = cKDTree(self.points)
        self._triangles = np.asarray(mesh.triangles)
        self._middles = self._triangles.mean(axis=1)
        self._radii = np.linalg.norm(self._triangles - self._middles[:, None], axis=2).max(axis=1)

    def nearest(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """The point of the mesh (3,) that is nearest to another one, of all triangles [m]."""
        within = self.tree.query(point)[0]  # no farther than this
        near = self._triangles[np.linalg.norm(self._middles - point, axis=1) <= self._radii + within]
        closest = trimesh.triangles.closest_point(near, np.tile(point, (len(near), 1)))
        return np.asarray(closest[np.linalg.norm(closest - point, axis=1).argmin()])


def dense_grasps_chapter(bench: Bench) -> Chapter:
    """Check the feasible grasps of ``repeats`` plans of every object."""
    measured = [_measure(bench, bench.model(name)) for name in bench.objects]
    rows = [
        [
            one.name,
            f"{one.grasps:,}",
            f"{one.in_object}",
            f"{1e3 * one.depth:.2f}",
            f"{one.in_links}",
            f"{1e3 * one.link_depth:.2f}",
            f"{one.tilted}",
            f"{one.pad_angle:.3f}",
        ]
        for one in measured
    ]
    totals = {
        name: sum(getattr(one, name) for one in measured) for name in ("grasps", "in_object", "in_links", "tilted")
    }
    text = (
        f"Of {totals['grasps']:,} feasible grasps of {bench.hand.name}, {bench.starts} starts a plan, "
        f"{totals['in_object']} have a link more than {1e3 * MAX_DEPTH:g} mm in the object, {totals['in_links']} a "
        f"link as deep in another one, {totals['tilted']} a pad that touches more than {MAX_PAD_ANGLE:g} rad off its "
        f"middle; at {POINTS:,} points on every object, in the hulls of the links, and on all triangles.\n\n"
        + table(
            ["object", "grasps", "in object", "deepest mm", "in links", "deepest mm", "tilted", "largest rad"], rows
        )
    )
    return Chapter("Dense check of feasible grasps", text, {}, {"objects": [asdict(one) for one in measured]})


def _measure(bench: Bench, model: ObjectModel) -> GraspsOfObject:
    bench.note(f"dense check of grasps of {model.name}")
    dense = DenseObject(model)
    found = np.array([measure_grasp(run, bench.hand, dense) for run in _feasible(bench, model)]).reshape(-1, 3)
    depths, link_depths, angles = found.T
    return GraspsOfObject(
        name=model.name,
        grasps=len(found),
        in_object=int((depths > MAX_DEPTH + ACCURACY).sum()),
        in_links=int((link_depths > MAX_DEPTH + ACCURACY).sum()),
        tilted=int((angles > MAX_PAD_ANGLE).sum()),
        depth=float(depths.max(initial=0.0)),
        link_depth=float(link_depths.max(initial=0.0)),
        pad_angle=float(angles.max(initial=0.0)),
    )


def _feasible(bench: Bench, model: ObjectModel) -> Iterator[Run]:
    for number in range(bench.repeats):
        found = find_grasps(model, bench.hand, starts=bench.starts, seed=SEED + number, top_k=1)
        yield from (run for run in found.runs if run.feasible)


def measure_grasp(run: Run, hand: Hand, dense: DenseObject) -> tuple[float, float, float]:
    """How deep a link lies in the object [m] and in another link [m], and the largest angle of a pad [rad]."""
    final = run.final
    poses = hand.shape_poses(final.joints, final.object_from_palm)
    in_object = [transform_points(pose, points) for pose, points in zip(poses, link_points(hand), strict=True)]
    depth = 0.0
    for pose, points, spaces in zip(poses, in_object, half_spaces(hand), strict=True):
        middle = points.mean(axis=0)
        near = dense.points[dense.tree.query_ball_point(middle, np.linalg.norm(points - middle, axis=1).max())]
        heights = ((near - pose[:3, 3]) @ pose[:3, :3]) @ spaces[:, :3].T - spaces[:, 3]
        depth = max(depth, float(-heights.max(axis=1).min(initial=0.0)))
    return depth, max(0.0, link_depth(hand, poses, in_object)), max(_pad_angles(run, hand, dense))


def _pad_angles(run: Run, hand: Hand, dense: DenseObject) -> Iterator[float]:
    """How far from its middle the cap of each finger's pad touches the mesh [rad]."""
    pose = hand.pose(run.final.joints, run.final.object_from_palm)
    for _, center, normal in zip(hand.fingers, pose.pads, pose.pad_normals, strict=False):
        towards = dense.nearest(center) - center
        yield float(np.arccos(np.clip(towards @ normal / np.linalg.norm(towards), -1.0, 1.0)))
