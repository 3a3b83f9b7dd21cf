"""Forward kinematics and the quality Q as CasADi expressions, from the same arrays that the planner's kernels read."""

import casadi
import numpy as np

from fingersplit.hands.hand import Hand

__all__ = ["manipulability", "object_quality", "pads_in_palm", "rotation_about_z"]

MIN_AREA = 1e-12
"""Added under the root of the doubled triangle area, so that it has a gradient where a triangle has none [m^4]."""


def rotation_about_z(angle: casadi.MX) -> casadi.MX:
    """Rotation by ``angle`` [rad] about z, (3, 3)."""
    sine, cosine = casadi.sin(angle), casadi.cos(angle)
    return casadi.blockcat([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def pads_in_palm(hand: Hand, joints: casadi.MX) -> list[casadi.MX]:
    """Centre of every finger's spherical pad in the palm frame, (3,) [m], at ``joints`` (N,) [rad]."""
    arrays, pads = hand.arrays, []
    for f in range(len(hand.fingers)):
        rotation, position = casadi.MX.eye(3), casadi.MX.zeros(3)
        for j in range(arrays.joint_counts[f]):
            position += rotation @ arrays.positions[f, j]
            rotation = rotation @ arrays.rotations[f, j] @ rotation_about_z(joints[int(arrays.joint_indices[f, j])])
        pads.append(position + rotation @ arrays.pad_positions[f])
    return pads


def object_quality(contacts: casadi.MX) -> casadi.MX:
    """Q_o of [Fan2018]: twice the area of the triangle of three contacts, columns of (3, 3) [m^2]."""
    spanned = casadi.cross(contacts[:, 1] - contacts[:, 0], contacts[:, 2] - contacts[:, 0])
    return casadi.sqrt(casadi.sumsqr(spanned) + MIN_AREA)


def manipulability(hand: Hand, joints: casadi.MX) -> casadi.MX:
    """Q_h of [Fan2018]: minus half the squared distances of the joints (N,) [rad] from mid-range, over their ranges."""
    middle, width = np.asarray((hand.upper + hand.lower) / 2), np.asarray(hand.upper - hand.lower)
    return -0.5 * casadi.sumsqr((joints - middle) / width)
