"""The state that finger splitting changes, and the scratch memory of its kernels: one record each."""

from typing import Any, NamedTuple

import numpy as np

from fingersplit.compilation import kernel
from fingersplit.hands.kernel import (
    MAX_FINGERS,
    MAX_HAND_JOINTS,
    MAX_JOINTS,
    MAX_SHAPES,
    POSE_FIELDS,
)
from fingersplit.objects.grid import PointGrid
from fingersplit.objects.signed_distance import DistanceGrid
from fingersplit.objects.surface import Surface, closest
from fingersplit.splitting.clock import seconds
from fingersplit.splitting.collision import measure_clearances
from fingersplit.splitting.objective import manipulability, object_quality
from fingersplit.splitting.potential import penalty
from fingersplit.vectors import add, angle_between, get, norm, put, scale, subtract

__all__ = [
    "MAX_PRESHAPES",
    "MAX_STANDOFFS",
    "STATE",
    "WORK",
    "Problem",
    "attach_contacts",
    "evaluate",
    "measure_collision",
    "new_states",
    "new_work",
    "pad_target",
]

MAX_PRESHAPES, MAX_STANDOFFS = 8, 16
"""Most preshapes and standoffs that the Map has room for."""

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
        ("quality", np.float64),
        ("object_quality", np.float64),
        ("hand_quality", np.float64),
        ("penetration", np.float64),
        ("merit", np.float64),
        *POSE_FIELDS,  # last: numba takes a record for a kind of any other that it begins with
    ],
    align=True,
)
"""A grasp in the object frame.

- The posed hand: ``hands.kernel.POSE_FIELDS``.
- ``contacts`` c on the surface (F, 3) [m], their outward ``normals`` n (F, 3) and the nearest surface ``samples`` (F,).
- ``residuals`` of the fingertips from their contacts (F,) [m], and ``pad_angles`` between pad normal and inward surface
  normal (F,) [rad].
- ``clearances`` (K,) of the collision shapes from the object, negative inside, infinite when far [m], the object's
  points they are measured to and the shapes' outward normals there, (K, 3).
- ``quality`` Q, its parts w1 Q_o and w2 Q_h, the deepest ``penetration`` [m], and ``merit``: Q less the potentials.
"""

WORK = np.dtype(
    [
        ("contact_gradient", np.float64, (MAX_FINGERS, 3)),
        ("joint_gradient", np.float64, MAX_HAND_JOINTS),
        ("twist_gradient", np.float64, 6),
        ("contact_step", np.float64, (MAX_FINGERS, 3)),
        ("joint_step", np.float64, MAX_HAND_JOINTS),
        ("twist", np.float64, 6),
        ("matrix", np.float64, (3 * MAX_FINGERS, 3 * MAX_FINGERS)),
        ("columns", np.float64, (3 * MAX_FINGERS, 2)),
        ("frozen", np.int8, MAX_HAND_JOINTS),
        ("lowest", np.float64, MAX_JOINTS),
        ("highest", np.float64, MAX_JOINTS),
        ("steps", np.float64, MAX_JOINTS),
        ("rotation", np.float64, (3, 3)),
        ("combinations", np.float64, (MAX_PRESHAPES, MAX_STANDOFFS)),
        ("clock", np.int64, 2),
        ("times", np.float64, 12),
    ],
    align=True,
)
"""Scratch memory of one run.

- ``contact_gradient`` (F, 3), ``joint_gradient`` (N,), ``twist_gradient`` (6,): of the merit.
- ``contact_step`` (F, 3) [m], ``joint_step`` (N,) [rad] or [rad/s], ``twist`` (6,): the tangent step d_c, d_q, V_po^b.
- ``matrix``, ``columns``, ``frozen``, ``lowest``, ``highest``, ``steps``: of the solvers.
- ``combinations``: costs of preshapes and standoffs, of the Map.
- ``times`` [s]: tangent search, projection and test with collision, collision alone; for each phase of the trace.
"""


class Problem(NamedTuple):
    """What stays the same over a run.

    Attributes:
        hand: ``hands.kernel.HAND`` record.
        settings: ``settings.SETTINGS`` record.
        surface: Surface samples of the object.
        collision: Sparser surface points for collision tests.
        distance: Signed distance grid of the object.
        center: Centre of mass in the object frame [m].
    """

    hand: Any
    settings: Any
    surface: Surface
    collision: PointGrid
    distance: DistanceGrid
    center: tuple[float, float, float]


def new_states(count: int) -> np.recarray:
    """``STATE`` records (count,), zero but for the samples, which are unknown."""
    states = np.rec.array(np.zeros(count, STATE))
    states.samples[:] = -1
    return states


def new_work() -> np.record:
    """A ``WORK`` record."""
    work: np.record = np.rec.array(np.zeros(1, WORK))[0]
    return work


@kernel
def pad_target(hand, state, finger):
    """Where the pad's centre belongs: c + r n, so that the pad touches its contact and lies outside [m]."""
    return add(get(state.contacts, finger), scale(hand.pad_radii[finger], get(state.normals, finger)))


@kernel
def attach_contacts(surface, hand, state):
    """(c, n) <- NN(f): every contact becomes the surface point nearest to its pad."""
    for finger in range(hand.finger_count):
        sample, point, normal = closest(surface, get(state.pads, finger), state.samples[finger])
        state.samples[finger] = sample
        put(state.contacts, finger, point)
        put(state.normals, finger, normal)


@kernel
def evaluate(hand, settings, state):
    """Residuals, pad angles, Q and its parts of a state whose pose and contacts are up to date."""
    for finger in range(hand.finger_count):
        gap = subtract(pad_target(hand, state, finger), get(state.pads, finger))
        state.residuals[finger] = norm(gap)
        inward = scale(-1.0, get(state.normals, finger))
        state.pad_angles[finger] = angle_between(get(state.pad_normals, finger), inward)
    state.object_quality = settings.object_weight * object_quality(state.contacts, hand.finger_count)
    state.hand_quality = settings.hand_weight * manipulability(hand, state.joints)
    state.quality = state.object_quality + state.hand_quality
    state.merit = state.quality


@kernel
def measure_collision(problem, state, work, phase):
    """Clearances, penetration and merit of an evaluated state; its time counts for ``phase``."""
    started = seconds(work.clock)
    measure_clearances(problem.hand, state, problem.collision, problem.distance, work.rotation)
    state.merit = state.quality - penalty(problem.hand, problem.settings, state)
    work.times[3 * phase + 2] += seconds(work.clock) - started
