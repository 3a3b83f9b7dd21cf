"""A hand and a posed hand as one record each.

Kernels pass a record as a single pointer, where a tuple of arrays would cost a copy and a reference count for every
array at every call. All have the room of ``hands.limits``.
"""

import numpy as np

from fingersplit.hands.limits import (
    MAX_CHAIN_DRIVERS,
    MAX_CHAIN_JOINTS,
    MAX_DRIVERS,
    MAX_FINGERS,
    MAX_JOINTS,
    MAX_PAIRS,
    MAX_SHAPES,
    MAX_SPHERES,
    SHAPE_NUMBERS,
)

__all__ = ["HAND", "POSE", "POSE_FIELDS"]

HAND = np.dtype(
    [
        ("finger_count", np.int64),
        ("chain_count", np.int64),
        ("joint_count", np.int64),
        ("driver_count", np.int64),
        ("shape_count", np.int64),
        ("sphere_count", np.int64),
        ("pair_count", np.int64),
        ("joint_counts", np.int64, MAX_FINGERS),
        ("joint_indices", np.int64, (MAX_FINGERS, MAX_CHAIN_JOINTS)),
        ("rotations", np.float64, (MAX_FINGERS, MAX_CHAIN_JOINTS, 3, 3)),
        ("positions", np.float64, (MAX_FINGERS, MAX_CHAIN_JOINTS, 3)),
        ("pad_positions", np.float64, (MAX_FINGERS, 3)),
        ("pad_normals", np.float64, (MAX_FINGERS, 3)),
        ("pad_radii", np.float64, MAX_FINGERS),
        ("pad_angle_scales", np.float64, MAX_FINGERS),
        ("lower", np.float64, MAX_JOINTS),
        ("upper", np.float64, MAX_JOINTS),
        ("coupling", np.float64, (MAX_JOINTS, MAX_DRIVERS)),
        ("coupling_offset", np.float64, MAX_JOINTS),
        ("driver_lower", np.float64, MAX_DRIVERS),
        ("driver_upper", np.float64, MAX_DRIVERS),
        ("driver_counts", np.int64, MAX_FINGERS),
        ("driver_indices", np.int64, (MAX_FINGERS, MAX_CHAIN_DRIVERS)),
        ("mixed_count", np.int64),
        ("mixed_joints", np.int64, MAX_JOINTS),
        ("uncoupled", np.bool_),
        ("fingers_coupled", np.bool_),
        ("shape_kinds", np.int64, MAX_SHAPES),
        ("shape_fingers", np.int64, MAX_SHAPES),
        ("shape_links", np.int64, MAX_SHAPES),
        ("shape_rotations", np.float64, (MAX_SHAPES, 3, 3)),
        ("shape_positions", np.float64, (MAX_SHAPES, 3)),
        ("shape_sizes", np.float64, (MAX_SHAPES, SHAPE_NUMBERS)),
        ("shape_radii", np.float64, MAX_SHAPES),
        ("sphere_starts", np.int64, MAX_SHAPES + 1),
        ("sphere_shapes", np.int64, MAX_SPHERES),
        ("sphere_centers", np.float64, (MAX_SPHERES, 3)),
        ("sphere_radii", np.float64, MAX_SPHERES),
        ("sphere_insides", np.float64, MAX_SPHERES),
        ("pairs", np.int16, (MAX_PAIRS, 2)),
    ],
    align=True,
)
"""A hand as data: F fingers, N joints, A drivers, K collision shapes, M spheres; frames follow the links outwards.

The first ``finger_count`` of ``chain_count`` chains are the fingers that grasp; others are posed and tested for
collisions. A joint may stand in several chains. ``hands.drivers.set_drivers`` writes what concerns drivers.

- ``joint_counts`` (F,), ``joint_indices`` (F, MAX_CHAIN_JOINTS): joints of each finger, and their places in the joint
  vector.
- ``rotations``, ``positions`` [m]: ``previous_from_joint`` at zero angle; a joint frame turns about its own z axis.
- ``pad_positions`` [m], ``pad_normals``, ``pad_radii`` [m]: spherical pad in the last link's frame, normal out of it.
- ``pad_angle_scales`` (F,): tilt that a pad tolerates, over that of a usual pad (``limits.PAD_ANGLE_LIMIT``).
- ``lower``, ``upper`` (N,): joint limits [rad].
- ``coupling`` S (N, A) and ``coupling_offset`` q0 (N,) [rad]: joints q = S theta + q0 of drivers theta;
  ``driver_lower``, ``driver_upper`` (A,) [rad] keep every joint that follows one driver alone within its own limits.
- ``mixed_joints`` (mixed_count,): joints that follow several drivers, whose limits are no limits of one driver.
- ``driver_counts`` (F,), ``driver_indices`` (F, MAX_CHAIN_DRIVERS): drivers that move each chain; ``uncoupled``: S = I
  and q0 = 0; ``fingers_coupled``: a driver moves several fingers, so that they cannot be solved for one by one.
- ``shape_kinds`` (see ``hands.shapes``), ``shape_fingers`` (-1 for the palm), ``shape_links`` (joint of that finger
  whose link carries the shape), ``link_from_shape`` as ``shape_rotations`` and ``shape_positions`` [m],
  ``shape_sizes`` [m]: sizes as ``shape_distance`` takes them, and ``shape_radii`` [m] about the centre.
- ``sphere_shapes``, ``sphere_centers`` [m] in the link frame, ``sphere_radii`` [m]: spheres that together enclose every
  shape, those of shape k from ``sphere_starts[k]`` to the next one's; with the radii ``sphere_insides`` [m] they lie
  inside it.
- ``pairs`` (pair_count, 2): shapes of the hand that may not meet.
"""

POSE_FIELDS = [
    ("palm_rotation", np.float64, (3, 3)),
    ("palm_position", np.float64, 3),
    ("drivers", np.float64, MAX_DRIVERS),
    ("joints", np.float64, MAX_JOINTS),
    ("link_rotations", np.float64, (MAX_FINGERS, MAX_CHAIN_JOINTS, 3, 3)),
    ("link_positions", np.float64, (MAX_FINGERS, MAX_CHAIN_JOINTS, 3)),
    ("pads", np.float64, (MAX_FINGERS, 3)),
    ("pad_normals", np.float64, (MAX_FINGERS, 3)),
    ("jacobians", np.float64, (MAX_FINGERS, 3, MAX_CHAIN_DRIVERS)),
]
"""Where a hand stands in some frame (here the object's).

``object_from_palm`` and ``joints`` [rad] are the input of ``move_fingers``; its output are ``object_from_link``, the
pad centres [m], the unit vectors out of the pads, and the pad centres by the drivers that move the finger
(``driver_indices``), J_theta = J S with ``J_q2c,i`` of [Fan2018] eq. (3b) as J [m/rad]. ``move_drivers`` sets the
joints from the ``drivers`` [rad] first.
"""

POSE = np.dtype(POSE_FIELDS, align=True)
