"""The state that finger splitting changes, and the scratch memory of its kernels: one record each."""

from typing import Any, NamedTuple

import numpy as np

from fingersplit.hands.limits import (
    MAX_DRIVERS,
    MAX_FINGERS,
    MAX_PRESHAPES,
    MAX_SHAPES,
    MAX_STANDOFFS,
    MAX_UNKNOWNS,
)
from fingersplit.hands.records import POSE_FIELDS
from fingersplit.objects.grid import PointGrid
from fingersplit.objects.signed_distance import DistanceGrid
from fingersplit.objects.surface import Surface
from fingersplit.scene.convex_kernel import GJK_ROWS
from fingersplit.scene.obstacles import OBSTACLE_WORK, SLACKS, SceneArrays

__all__ = ["PHASE_TIMES", "STATE", "TIMES", "WORK", "Problem", "new_states", "new_times", "new_work"]

STATE = np.dtype(
    [
        ("contacts", np.float64, (MAX_FINGERS, 3)),
        ("normals", np.float64, (MAX_FINGERS, 3)),
        ("samples", np.int64, MAX_FINGERS),
        ("residuals", np.float64, MAX_FINGERS),
        ("pad_angles", np.float64, MAX_FINGERS),
        ("clearances", np.float64, MAX_SHAPES),
        ("clearance_points", np.float64, (MAX_SHAPES, 3)),
        ("clearance_normals", np.float64, (MAX_SHAPES, 3)),
        ("around", SLACKS),
        ("quality", np.float64),
        ("object_quality", np.float64),
        ("hand_quality", np.float64),
        ("penetration", np.float64),
        ("self_clearance", np.float64),
        ("merit", np.float64),
        *POSE_FIELDS,  # last: numba takes a record for a kind of any other that it begins with
    ],
    align=True,
)
"""A grasp in the object frame.

- The posed hand: ``hands.records.POSE_FIELDS``.
- ``contacts`` c on the surface (F, 3) [m], their outward ``normals`` n (F, 3) and the nearest surface ``samples`` (F,).
- ``residuals`` of the fingertips from their contacts (F,) [m], and ``pad_angles`` between pad normal and inward surface
  normal (F,) [rad].
- ``clearances`` (K,) of the collision shapes from the object, negative inside, infinite when far [m], the object's
  points they are measured to and the shapes' outward normals there, (K, 3).
- ``around``: slack of the collision shapes from what stands around the object, infinite without a scene.
- ``quality`` Q, its parts w1 Q_o and w2 Q_h, the deepest ``penetration`` [m], the least distance of
  two links ``self_clearance`` [m], infinite when far, and ``merit``: Q less the potentials.
"""

PHASE_TIMES = np.dtype([("search", np.float64), ("projection", np.float64), ("collision", np.float64)], align=True)
"""Where the time of a phase went [s]: tangent search, projection and test, collision."""

TIMES = np.dtype([(phase, PHASE_TIMES) for phase in ("cpo", "ppo", "map", "settle")], align=True)
"""Where the time of one run went, by phase."""

STEP_WORK = np.dtype(
    [
        ("contact_gradient", np.float64, (MAX_FINGERS, 3)),
        ("driver_gradient", np.float64, MAX_DRIVERS),
        ("twist_gradient", np.float64, 6),
        ("contact_step", np.float64, (MAX_FINGERS, 3)),
        ("driver_step", np.float64, MAX_DRIVERS),
        ("twist", np.float64, 6),
        ("displacements", np.float64, (MAX_FINGERS, 3)),
    ],
    align=True,
)
"""A tangent step: the gradient of the merit by contacts (F, 3), drivers (A,) and object twist (6,), and the step d_c
(F, 3) [m], d_theta (A,) [rad] or [rad/s], V_po^b (6,); then the ``displacements`` that fingertips follow (F, 3) [m]."""

SOLVER_WORK = np.dtype(
    [
        ("normal", np.float64, (MAX_UNKNOWNS, MAX_UNKNOWNS)),
        ("right", np.float64, MAX_UNKNOWNS),
        ("row", np.float64, MAX_UNKNOWNS),
        ("matrix", np.float64, (MAX_UNKNOWNS, MAX_UNKNOWNS)),
        ("column", np.float64, (MAX_UNKNOWNS, 1)),
        ("columns", np.float64, (MAX_UNKNOWNS, 2)),
        ("constraints", np.float64, (MAX_UNKNOWNS, MAX_FINGERS + 1)),
        ("multipliers", np.float64, (MAX_FINGERS, MAX_FINGERS)),
        ("multiplier", np.float64, (MAX_FINGERS, 1)),
        ("frozen", np.int8, MAX_UNKNOWNS),
        ("lowest", np.float64, MAX_UNKNOWNS),
        ("highest", np.float64, MAX_UNKNOWNS),
        ("steps", np.float64, MAX_UNKNOWNS),
    ],
    align=True,
)
"""Room for small systems of equations, their active set, and bounded least squares: normal equations, bounds, steps."""

MAP_WORK = np.dtype(
    [
        ("combinations", np.float64, (MAX_PRESHAPES, MAX_STANDOFFS)),
        ("drivers", np.float64, MAX_DRIVERS),
    ],
    align=True,
)
"""Costs of all preshapes and standoffs, and the drivers of the next iteration (A,) [rad]."""

SELF_WORK = np.dtype(
    [
        ("centers", np.float64, (MAX_SHAPES, 3)),
        ("rotations", np.float64, (2, 3, 3)),
        ("rows", np.float64, (GJK_ROWS, 3)),
    ],
    align=True,
)
"""Places of all collision shapes, and room for the distance of two."""

WORK = np.dtype(
    [
        ("own", SELF_WORK),
        ("step", STEP_WORK),
        ("solver", SOLVER_WORK),
        ("map", MAP_WORK),
        ("around", OBSTACLE_WORK),
        ("rotation", np.float64, (3, 3)),
        ("clock", np.int64, 2),
    ],
    align=True,
)
"""Scratch memory of one run."""


class Problem(NamedTuple):
    """What stays the same over a run.

    Attributes:
        hand: ``hands.records.HAND`` record.
        settings: ``settings.SETTINGS`` record.
        surface: Surface samples of the object.
        collision: Sparser surface points for collision tests.
        distance: Signed distance grid of the object.
        center: Centre of mass in the object frame [m].
        limits: ``scene.limits.LIMITS`` record.
        scene: Obstacles and contact regions; None without any, which compiles to kernels that know of none.
    """

    hand: Any
    settings: Any
    surface: Surface
    collision: PointGrid
    distance: DistanceGrid
    center: tuple[float, float, float]
    limits: Any
    scene: SceneArrays | None


def new_states(count: int) -> np.recarray:
    """``STATE`` records (count,), zero but for the samples, which are unknown, and slacks, which are infinite."""
    states = np.zeros(count, STATE)  # records are slow to read by name in Python
    states["samples"] = -1
    states["around"]["slacks"], states["around"]["least"] = np.inf, np.inf
    return np.rec.array(states)


def new_work() -> np.record:
    """A ``WORK`` record."""
    work: np.record = np.rec.array(np.zeros(1, WORK))[0]
    return work


def new_times() -> np.record:
    """A ``TIMES`` record, all zero."""
    times: np.record = np.rec.array(np.zeros(1, TIMES))[0]
    return times
