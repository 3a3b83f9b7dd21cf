"""What is measured on a hand, a function for each part of the report."""

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.draft.pad_samples import ANGLE, TOLERANCE, pad_samples
from fingersplit.hands.draft.sampling import Samples
from fingersplit.hands.forward import link_poses
from fingersplit.hands.hand import Hand
from fingersplit.hands.self_collision import self_collision_pairs, shape_distances

__all__ = [
    "couplings",
    "jacobian_error",
    "kinematics_error",
    "opposition_volume",
    "pad_errors",
    "pads_in_jaws",
    "reaches",
    "self_collisions",
]

Array = NDArray[np.float64]

STEP = 1e-6
"""[rad]; of central differences."""
ASIDE = 5
"""Cells, that is 40 mm."""
OPPOSED_WIDTHS = np.arange(0.02, 0.13, 0.01)


def couplings(hand: Hand) -> list[dict[str, Any]]:
    """Each driven joint: its drivers with their ratios, its offset [rad], and its angle with drivers half-way [rad]."""
    coupling = hand.model.coupling
    half = hand.model.joints_from_drivers((coupling.lower + coupling.upper) / 2)
    return [
        {
            "joint": joint.name,
            "ratios": {coupling.drivers[a]: float(row[a]) for a in np.flatnonzero(row)},
            "offset": float(coupling.offset[j]),
            "half_way": float(half[j]),
        }
        for j, (joint, row) in enumerate(zip(hand.model.joints, coupling.matrix, strict=True))
        if joint.name not in coupling.drivers
    ]


def kinematics_error(hand: Hand, samples: Samples) -> float:
    """Largest distance [m] of a collision shape's centre from where MuJoCo has its link, over postures."""
    compiled = hand.spec().compile()
    data = mujoco.MjData(compiled)
    places = [int(compiled.joint(name).qposadr[0]) for name in hand.joint_names]
    bodies = [int(compiled.body(hand.model.links[shape.link].name).id) for shape in hand.model.shapes]
    worst = 0.0
    for drivers in samples.drivers:
        joints = _with_parked(hand, hand.model.joints_from_drivers(drivers))
        data.qpos[places] = joints
        mujoco.mj_kinematics(compiled, data)
        for shape, body, pose in zip(hand.model.shapes, bodies, hand.shape_poses(joints), strict=True):
            expected = data.xmat[body].reshape(3, 3) @ shape.pose[:3, 3] + data.xpos[body]
            worst = max(worst, float(np.linalg.norm(pose[:3, 3] - expected)))
    return worst


def jacobian_error(hand: Hand, samples: Samples) -> float:
    """Largest difference [m/rad] of a pad's Jacobian by its drivers from central differences, over postures."""
    worst, records = 0.0, hand.arrays
    for drivers in samples.drivers:
        joints = _with_parked(hand, hand.model.joints_from_drivers(drivers))
        pose = hand.pose(joints)
        for f in range(len(hand.fingers)):
            for column, driver in enumerate(records.driver_indices[f, : records.driver_counts[f]]):
                turn = STEP * records.coupling[: len(joints), driver]
                slope = (hand.pose(joints + turn).pads[f] - hand.pose(joints - turn).pads[f]) / (2 * STEP)
                worst = max(worst, float(np.abs(pose.jacobians[f, :, column] - slope).max()))
    return worst


def pad_errors(hand: Hand, samples: Samples) -> tuple[float, float]:
    """Largest difference of active pads [m] and their Jacobians by drivers [m/rad] from MuJoCo's, over postures."""
    compiled = hand.spec().compile()
    data = mujoco.MjData(compiled)
    places = [int(compiled.joint(name).qposadr[0]) for name in hand.joint_names]
    speeds = [int(compiled.joint(name).dofadr[0]) for name in hand.joint_names]
    bodies = [int(compiled.body(hand.model.links[pad.link].name).id) for pad in hand.pads]
    records, jacobian = hand.arrays, np.zeros((3, compiled.nv))
    position_error = jacobian_error = 0.0
    for drivers in samples.drivers:
        joints = _with_parked(hand, hand.model.joints_from_drivers(drivers))
        data.qpos[places] = joints
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_comPos(compiled, data)
        pose = hand.pose(joints)
        for f, (pad, body) in enumerate(zip(hand.pads, bodies, strict=True)):
            expected = data.xmat[body].reshape(3, 3) @ pad.center + data.xpos[body]
            mujoco.mj_jac(compiled, data, jacobian, None, expected, body)
            columns = records.driver_indices[f, : records.driver_counts[f]]
            slopes = jacobian[:, speeds] @ records.coupling[: len(joints), columns]
            position_error = max(position_error, float(np.abs(pose.pads[f] - expected).max()))
            difference = pose.jacobians[f, :, : len(columns)] - slopes
            jacobian_error = max(jacobian_error, float(np.abs(difference).max()))
    return position_error, jacobian_error


def reaches(hand: Hand, samples: Samples) -> list[dict[str, Any]]:
    """Nearest and farthest place of each active pad from the palm's origin, and the box they are all in [m]."""
    found = []
    for finger, pad in zip(hand.fingers, hand.pads, strict=True):
        contacts = pad_samples(pad, samples).contacts
        distances = np.linalg.norm(contacts, axis=1)
        found.append(
            {
                "finger": finger.name,
                "nearest": float(distances.min()),
                "farthest": float(distances.max()),
                "low": contacts.min(axis=0).tolist(),
                "high": contacts.max(axis=0).tolist(),
            }
        )
    return found


def opposition_volume(hand: Hand, samples: Samples) -> dict[str, Any]:
    """Volume [m^3] of jaw centres about which pads of both jaws can stand and face each other, and for which openings.

    A jaw counts with any one of its fingers, which may stand up to 40 mm aside of the other jaw's; places with all of
    them are what preshapes and the jaw table decide.
    """
    rotation = hand.gripper.palm_from_gripper
    cells: dict[int, dict[tuple[int, ...], None]] = {0: {}, 1: {}}
    for pad, jaw in zip(hand.pads, hand.gripper.groups, strict=True):
        where = pad_samples(pad, samples)
        side = -1.0 if jaw == 0 else 1.0
        facing = side * (where.normals @ rotation[:, 1]) > math.cos(ANGLE)
        grid = np.floor(where.contacts[facing] @ rotation / TOLERANCE).astype(int)
        cells[int(jaw)].update(dict.fromkeys(map(tuple, grid.tolist())))
    centers, openings = set(), []
    for width in OPPOSED_WIDTHS:
        steps = round(width / TOLERANCE)
        hits = {
            (x, y - steps // 2, z)
            for x, y, z in cells[0]
            if any((x + aside, y - steps, z) in cells[1] for aside in range(-ASIDE, ASIDE + 1))
        }
        centers |= hits
        if hits:
            openings.append(float(width))
    return {"volume": len(centers) * TOLERANCE**3, "openings": [min(openings), max(openings)] if openings else None}


def self_collisions(hand: Hand) -> list[dict[str, Any]]:
    """For each preshape the nearest pair of shapes that are tested against each other, and their distance [m]."""
    pairs = self_collision_pairs(hand.model)
    if not len(pairs):
        return []
    found = []
    for number, joints in enumerate(hand.gripper.preshapes):
        distances = shape_distances(hand.model, joints, pairs)
        nearest = int(distances.argmin())
        names = [hand.shape_names[k] for k in pairs[nearest]]
        found.append({"preshape": number, "distance": float(distances[nearest]), "shapes": names})
    return found


def pads_in_jaws(hand: Hand) -> list[dict[str, Any]]:
    """For each preshape how far the mean of each jaw's pad normals is from facing the other jaw [rad]."""
    jaw = hand.gripper.palm_from_gripper[:, 1]
    found = []
    for number, joints in enumerate(hand.gripper.preshapes):
        poses = link_poses(hand.model, joints)
        angles = []
        for side in (0, 1):
            pads = [pad for pad, group in zip(hand.pads, hand.gripper.groups, strict=True) if group == side]
            mean = np.mean([poses[pad.link, :3, :3] @ pad.normal for pad in pads], axis=0)
            along = mean @ jaw * (1 if side else -1) / max(float(np.linalg.norm(mean)), 1e-9)
            angles.append(float(np.arccos(np.clip(along, -1, 1))))
        found.append({"preshape": number, "angles": angles})
    return found


def _with_parked(hand: Hand, joints: Array) -> Array:
    """Joint angles with those of parked fingers where they are parked."""
    return np.where(hand.lower == hand.upper, hand.lower, joints)
