"""What a scene is described with: the hand, actuators, the object, sensors."""

from itertools import combinations
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.hands.self_collision import self_collision_pairs
from fingersplit.objects.convex_pieces import ConvexPieces

__all__ = [
    "CONDIM",
    "OBJECT",
    "PALM_FRAME",
    "SOLIMP",
    "SOLREF",
    "add_object",
    "add_sensors",
    "drive_fingertips",
    "drive_joints",
    "finger_chains",
    "fingertip_servo_names",
    "grip_site",
    "limit_joints",
    "mount_hand",
    "pair_name",
    "servo_name",
]

OBJECT, PALM_FRAME = "object", "palm_frame"

JOINT_ARMATURE, JOINT_DAMPING = 2e-3, 0.02
"""Of the drives, which the description of a hand leaves out: [kg m^2], [N m s/rad]."""
CONDIM, SOLREF, SOLIMP = 4, [0.005, 1], [0.9, 0.95, 0.001, 0.5, 2]
"""Contacts pass sliding and torsional friction; stiff, since a soft one lets a held object creep."""

_FOUND_FORCE_POSITION, _DISTANCE = 1 | 2 | 16, 8  # data of a contact sensor
_MIN_DISTANCE, _NET_FORCE = 1, 3  # its ways to reduce many contacts to one


def finger_chains(hand: Hand) -> list[list[str]]:
    """Names of each active finger's bodies from the palm outwards, the palm left out; then what they carry rigidly."""
    return [_chain(hand, pad.link) for pad in hand.pads]


def mount_hand(spec: Any, hand: Hand) -> None:
    """The palm fixed in the world (it is placed with the grasp), grip sites on the fingers, contact parameters."""
    links = hand.model.links
    spec.body(hand.palm).add_site(name=PALM_FRAME)
    for finger, pad in zip(hand.fingers, hand.pads, strict=True):
        spec.body(links[pad.link].name).add_site(name=grip_site(finger.name), pos=[0.01, 0, 0])  # moved with the grasp
    for first, second in sorted(_neighbours(hand)):
        spec.add_exclude(bodyname1=first, bodyname2=second)
    for link in links:
        body = spec.body(link.name)
        body.gravcomp = 1
        for geom in body.geoms:
            geom.condim, geom.priority, geom.solref, geom.solimp = CONDIM, 1, SOLREF, SOLIMP


def _chain(hand: Hand, last: int) -> list[str]:
    """Links from the palm to ``last``, and those that it carries, by name; the palm left out."""
    model = hand.model
    path = model.path(last)[1:]
    carried = [i for i in range(len(model.links)) if i not in path and last in model.path(i)]
    return [model.links[i].name for i in [*path, *carried]]


def _neighbours(hand: Hand) -> set[tuple[str, str]]:
    """Pairs of bodies that do not collide: of one finger, the palm and a finger's first two, and as the planner has it.

    Neighbours overlap at their joint; what lies two joints apart may.
    """
    model, names = hand.model, [link.name for link in hand.model.links]
    pairs: set[tuple[str, str]] = set()
    for chain in (_chain(hand, finger.pads[0].link) for finger in hand.chains):
        pairs |= {pair for pair in combinations([hand.palm, *chain], 2) if pair[0] != hand.palm or pair[1] in chain[:2]}
    tested = {frozenset((model.shapes[i].link, model.shapes[j].link)) for i, j in self_collision_pairs(model).tolist()}
    carrying = sorted({shape.link for shape in model.shapes})
    pairs |= {(names[a], names[b]) for a, b in combinations(carrying, 2) if frozenset((a, b)) not in tested}
    known = {frozenset((names[a], names[b])) for a, b in model.excluded}
    order = {name: i for i, name in enumerate(names)}
    unique = {frozenset(pair): tuple(sorted(pair, key=order.__getitem__)) for pair in pairs}
    return {(pair[0], pair[1]) for key, pair in unique.items() if key not in known}


def drive_joints(spec: Any, hand: Hand) -> None:
    """A position servo on every driver of the active fingers."""
    for name in hand.driver_names:
        _add_servo(spec, servo_name(name), mujoco.mjtTrn.mjTRN_JOINT, name)


def drive_fingertips(spec: Any, hand: Hand) -> None:
    """Servos that move every grip site along the palm's axes, and a spring between every two of them."""
    for finger in hand.fingers:
        for name, gear in zip(fingertip_servo_names(finger.name), np.eye(3, 6), strict=True):
            servo = _add_servo(spec, name, mujoco.mjtTrn.mjTRN_SITE, grip_site(finger.name))
            servo.refsite, servo.gear = PALM_FRAME, gear
    for a, b in combinations(hand.fingers, 2):
        tendon = spec.add_tendon(name=pair_name(a.name, b.name))
        tendon.wrap_site(grip_site(a.name))
        tendon.wrap_site(grip_site(b.name))
        pull = _add_servo(spec, tendon.name, mujoco.mjtTrn.mjTRN_TENDON, tendon.name)
        pull.gaintype, pull.gainprm[1] = mujoco.mjtGain.mjGAIN_AFFINE, -1  # control [N/m] times length


def limit_joints(spec: Any, hand: Hand) -> None:
    """Torque-limited joints with gravity compensation and the drives' inertia; parked fingers held."""
    for name, (up, down) in zip(hand.joint_names, _joint_torque_ranges(hand).T, strict=True):
        joint = spec.joint(name)
        joint.armature, joint.damping[0] = JOINT_ARMATURE, JOINT_DAMPING
        joint.actfrclimited, joint.actfrcrange, joint.actgravcomp = 1, [-down, up], 1
    _hold_parked(spec, hand)


def _joint_torque_ranges(hand: Hand) -> NDArray[np.float64]:
    """Largest torque at each joint towards larger and smaller angles, (2, N) [N m]: that of its driver alone."""
    coupling, ranges = hand.model.coupling, hand.model.coupling.torque_ranges
    passed = np.abs(coupling.matrix)  # (N, A)
    ratios = np.divide(1.0, passed, out=np.full_like(passed, np.inf), where=passed > 0)
    turned = np.where(coupling.matrix[None] < 0, ranges[::-1, None], ranges[:, None])  # (2, N, A)
    limits = (ratios * turned).min(axis=2)
    return np.asarray(np.where(np.isfinite(limits), limits, ranges.max()))


def _hold_parked(spec: Any, hand: Hand) -> None:
    """Joints of parked fingers stay where they are."""
    for name, low, high, joint in zip(hand.joint_names, hand.lower, hand.upper, hand.model.joints, strict=True):
        if low == high:
            data = np.zeros(12)
            data[0] = low - joint.reference
            held = spec.add_equality(name=f"{name}_parked", type=mujoco.mjtEq.mjEQ_JOINT, name1=name)
            held.objtype, held.data = mujoco.mjtObj.mjOBJ_JOINT, data


def add_object(spec: Any, pieces: ConvexPieces) -> None:
    """A free body of convex pieces; its mass is set with the grasp."""
    body = spec.worldbody.add_body(name=OBJECT, mass=1.0, inertia=[1, 1, 1], explicitinertial=True)
    body.simple = 0  # its centre of mass is set later
    body.add_freejoint(name=OBJECT)
    for number, (vertices, faces) in enumerate(pieces.pieces):
        spec.add_mesh(
            name=f"piece{number}",
            uservert=vertices.ravel(),
            userface=faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # not used, and never refused
        )
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"piece{number}", mass=0, condim=CONDIM)


def add_sensors(spec: Any, hand: Hand, chains: list[list[str]]) -> None:
    """Per finger and for the palm what touches the object: found, force (3), position (3); then depth and torques."""
    subtree, alone = mujoco.mjtObj.mjOBJ_XBODY, mujoco.mjtObj.mjOBJ_BODY
    for name, part in [*((chain[0], subtree) for chain in chains), (hand.palm, alone)]:
        _add_contact_sensor(spec, name, part, [_FOUND_FORCE_POSITION, _NET_FORCE, 1])
    _add_contact_sensor(spec, hand.palm, subtree, [_DISTANCE, _MIN_DISTANCE, 1])
    for name in hand.joint_names:
        spec.add_sensor(type=mujoco.mjtSensor.mjSENS_JOINTACTFRC, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name)


def grip_site(finger: str) -> str:
    """Name of the site where a finger touches in a planned grasp."""
    return f"{finger}_grip"


def fingertip_servo_names(finger: str) -> list[str]:
    """Names of the servos of a finger's tip along the palm's axes."""
    return [f"{finger}_{axis}" for axis in "xyz"]


def pair_name(first: str, second: str) -> str:
    """Name of the virtual spring between two fingertips."""
    return f"{first}_to_{second}"


def servo_name(joint: str) -> str:
    """Name of a joint's position servo."""
    return f"{joint}_servo"


def _add_contact_sensor(spec: Any, name: str, part: Any, parameters: list[int]) -> None:
    spec.add_sensor(
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=part,
        objname=name,
        reftype=mujoco.mjtObj.mjOBJ_BODY,
        refname=OBJECT,
        intprm=parameters,
    )


def _add_servo(spec: Any, name: str, transmission: Any, target: str) -> Any:
    return spec.add_actuator(
        name=name,
        trntype=transmission,
        target=target,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        gainprm=np.zeros(10),
        biasprm=np.zeros(10),
    )
