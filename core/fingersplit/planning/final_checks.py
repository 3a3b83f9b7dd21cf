"""What is looked at once the runs are done, exactly: regions of contact, and obstacles that are meshes."""

from collections.abc import Sequence

import numpy as np

from fingersplit.feasibility.penetration_kernel import exact_penetration
from fingersplit.feasibility.violations_kernel import NEAR_OBSTACLE, OUTSIDE_REGION
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.run import Run
from fingersplit.scene.preparing import ObstacleMesh, PreparedScene
from fingersplit.splitting.collision_kernel import rough_penetration
from fingersplit.transforms import pose_matrix

__all__ = ["check_finally"]

ROUGH = 8e-3
"""[m]; a link that lies this deep in a solid by the distance grid surely lies in it."""


def check_finally(runs: Sequence[Run], scene: PreparedScene, model: ObjectModel) -> None:
    """Add to the runs' violations what their kernels know only roughly."""
    regions = scene.constraints.contact_regions
    if runs and not regions.unbounded:
        fingers = len(runs[0].hand.fingers)
        contacts = np.concatenate([run.last.contacts[:fingers] for run in runs])
        admitted = regions.admit(contacts, model).reshape(-1, fingers).all(axis=1)
        for run, inside in zip(runs, np.atleast_1d(admitted), strict=True):
            if not inside:
                run.outcome.violations |= 1 << OUTSIDE_REGION
    for run in runs if scene.meshes else ():
        if run.outcome.violations == 0:
            for mesh in scene.meshes:
                _check_mesh(run, mesh)


def _check_mesh(run: Run, mesh: ObstacleMesh) -> None:
    """Whether the hand keeps its clearance from the triangles of a mesh, and is not inside it."""
    hand, last = run.hand, run.last
    joints = last.joints[: len(hand.joint_names)]
    obstacle_from_palm = mesh.obstacle_from_object @ pose_matrix(last.palm_rotation, last.palm_position)
    pose, distance = hand.pose(joints, obstacle_from_palm), mesh.model.distance
    depth = exact_penetration(hand.arrays, pose, mesh.model.patches, distance, -mesh.clearance)
    within = rough_penetration(hand.arrays, pose, distance, np.inf)  # a link inside a solid is far from its triangles
    slack = -max(depth, within if within > ROUGH else depth) - mesh.clearance
    if slack < last.around.least:
        last.around.least = slack
    if slack < -1e-5:
        run.outcome.violations |= 1 << NEAR_OBSTACLE
