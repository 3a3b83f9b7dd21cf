"""Where the palm may be and how it may come and go, as compiled code reads it."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.scene.approach import MAX_CONES
from fingersplit.scene.constraints import Constraints

__all__ = ["LIMITS", "build_limits"]

MIN_SWEEP_STEP, MAX_SWEEP_STEP = 0.25e-3, 1e-3
"""[m]; a swept motion is looked at no more and no less often than this, wherever something is near."""

LIMITS = np.dtype(
    [
        ("cone_count", np.int64),
        ("cone_axes", np.float64, (MAX_CONES, 3)),
        ("cone_cosines", np.float64, MAX_CONES),
        ("desired_distance", np.float64),
        ("min_distance", np.float64),
        ("required", np.bool_),
        ("retreat", np.float64, 3),
        ("retreat_in_palm", np.bool_),
        ("retreat_desired_distance", np.float64),
        ("retreat_min_distance", np.float64),
        ("step", np.float64),
        ("palm_from_gripper", np.float64, (3, 3)),
        ("world_rotation", np.float64, (3, 3)),
        ("world_position", np.float64, 3),
        ("lowest", np.float64, 3),
        ("highest", np.float64, 3),
        ("reach_center", np.float64, 3),
        ("reach_least", np.float64),
        ("reach_most", np.float64),
    ],
    align=True,
)
"""Limits of the palm and its ways.

- ``cone_axes``, ``cone_cosines``: allowed directions of travel, object frame; with no cone all are allowed.
- Distances of approach and retreat [m]; ``retreat`` is a direction in the object frame, or in that of the palm.
- ``step``: longest step of a sweep beside an obstacle [m].
- ``palm_from_gripper``: columns lateral, jaw and approach axis.
- ``world_from_object`` as ``world_rotation`` and ``world_position`` [m]; in the world the palm's origin stays between
  ``lowest`` and ``highest``, and ``reach_least`` to ``reach_most`` away from ``reach_center`` [m].
"""


def build_limits(constraints: Constraints, world_from_object: NDArray[np.float64], hand: Hand) -> np.record:
    """The ``LIMITS`` record of a request."""
    limits: np.record = np.rec.array(np.zeros(1, LIMITS))[0]
    approach, scene, reach = constraints.approach, constraints.scene, constraints.end_effector.reach
    axes, cosines = approach.cones(world_from_object)
    limits.cone_count = len(axes)
    limits.cone_axes[: len(axes)], limits.cone_cosines[: len(axes)] = axes, cosines
    limits.desired_distance, limits.min_distance = approach.desired_distance, approach.min_distance
    limits.required = approach.required
    retreat = approach.retreat
    limits.retreat_in_palm = retreat.frame == "palm"
    turned = np.eye(3) if retreat.frame in ("palm", "object") else world_from_object[:3, :3].T
    limits.retreat = turned @ np.array(retreat.direction)
    limits.retreat_desired_distance, limits.retreat_min_distance = retreat.desired_distance, retreat.min_distance
    limits.step = min(max(0.5 * scene.clearance, MIN_SWEEP_STEP), MAX_SWEEP_STEP)
    limits.palm_from_gripper = hand.gripper.palm_from_gripper
    limits.world_rotation, limits.world_position = world_from_object[:3, :3], world_from_object[:3, 3]
    workspace = scene.workspace
    limits.lowest = -np.inf if workspace is None else workspace.min
    limits.highest = np.inf if workspace is None else workspace.max
    limits.reach_center = 0.0 if reach is None else reach.center
    limits.reach_least = 0.0 if reach is None else reach.min_radius
    limits.reach_most = np.inf if reach is None else reach.max_radius
    return limits
