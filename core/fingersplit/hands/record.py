"""A hand's model and one set of active fingers to the ``HAND`` record that kernels read."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.drivers import set_drivers
from fingersplit.hands.fingers import Chain, Pad
from fingersplit.hands.forward import joint_frame, link_poses, turn_about_z
from fingersplit.hands.limits import MAX_FINGERS, MAX_JOINTS, MAX_SHAPES, MAX_SPHERES, PAD_ANGLE_LIMIT
from fingersplit.hands.model import HandModel, Shape
from fingersplit.hands.records import HAND
from fingersplit.hands.self_collision import self_collision_pairs
from fingersplit.hands.shapes import bounding_radius, covering_spheres
from fingersplit.transforms import transform_points

__all__ = ["active_drivers", "hand_record"]

Array = NDArray[np.float64]


def hand_record(model: HandModel, active: Sequence[Chain], pads: Sequence[Pad], resting: Array) -> np.record:
    """The record of a hand of which some fingers touch; the shapes of all others stand still in the palm's frame.

    Args:
        model: The hand.
        active: Fingers that touch, in the order of every per-finger array.
        pads: The pad of each.
        resting: Joint angles (N,) [rad], of which those of parked fingers count.

    Raises:
        HandError: More joints, fingers, shapes or spheres than the kernels have room for, or a driver that moves active
            and parked fingers at once.
    """
    _check("active fingers", len(active), MAX_FINGERS)
    _check("joints", len(model.joints), MAX_JOINTS)
    _check("shapes", len(model.shapes), MAX_SHAPES)
    records = np.rec.array(np.zeros(1, HAND))
    hand: np.record = records[0]
    hand.finger_count, hand.chain_count, hand.joint_count = len(active), len(active), len(model.joints)
    places: dict[int, tuple[int, int, Array]] = {}
    for f, pad in enumerate(pads):
        _set_chain(hand, f, model, pad, places)
    _set_joints(hand, model, active, resting)
    still = link_poses(model, resting)
    hand.shape_count = len(model.shapes)
    for k, shape in enumerate(model.shapes):
        hand.shape_fingers[k], hand.shape_links[k], link_from_body = _place(model, shape.link, places, still)
        _set_shape(hand, k, shape, link_from_body @ shape.pose)
    pairs = self_collision_pairs(model)
    hand.pair_count = len(pairs)
    hand.pairs[: len(pairs)] = pairs
    records.setflags(write=False)
    frozen: np.record = records[0]
    return frozen


def active_drivers(model: HandModel, active: Sequence[Chain]) -> list[int]:
    """Drivers that move any joint of the active fingers."""
    joints = sorted({j for chain in active for j in chain.joints})
    return [int(a) for a in np.flatnonzero(np.any(model.coupling.matrix[joints] != 0, axis=0))]


def _check(what: str, count: int, most: int) -> None:
    if count > most:
        raise HandError(f"The hand has {count} {what}; at most {most} are planned for.")


def _set_joints(hand: np.record, model: HandModel, active: Sequence[Chain], resting: Array) -> None:
    """Joint limits and couplings; a joint that no driver of an active finger moves stands still."""
    coupling, drivers = model.coupling, active_drivers(model, active)
    matrix, offset = coupling.matrix[:, drivers].copy(), coupling.offset.copy()
    touching = {j for chain in active for j in chain.joints}
    for j, joint in enumerate(model.joints):
        if j not in touching and matrix[j].any():
            raise HandError(
                f"A grip parks the finger of {joint.name}, which moves with an active one; put it into a jaw, too."
            )
        moves = bool(matrix[j].any()) or not coupling.matrix[j].any()
        hand.lower[j], hand.upper[j] = (joint.lower, joint.upper) if moves else (resting[j], resting[j])
        if not moves:
            offset[j] = resting[j]
    set_drivers(hand, matrix, offset, coupling.lower[drivers], coupling.upper[drivers])


def _set_chain(hand: np.record, f: int, model: HandModel, pad: Pad, places: dict[int, tuple[int, int, Array]]) -> None:
    """One finger's joints and pad; for each of its links the place (finger, joint) and ``joint_from_link``."""
    last_from_body: Array = np.eye(4)
    count = 0
    for link in model.path(pad.link)[1:]:
        last_from_body = last_from_body @ model.links[link].pose
        for j in model.links[link].joints:
            body_from_link = joint_frame(model.joints[j])
            last_from_link = last_from_body @ body_from_link
            if model.joints[j].reference:
                last_from_link = last_from_link @ turn_about_z(-model.joints[j].reference)
            hand.rotations[f, count], hand.positions[f, count] = last_from_link[:3, :3], last_from_link[:3, 3]
            hand.joint_indices[f, count] = j
            count += 1
            last_from_body = np.asarray(np.linalg.inv(body_from_link))
        if count:
            places.setdefault(link, (f, count - 1, last_from_body))
    hand.joint_counts[f] = count
    hand.pad_positions[f] = transform_points(last_from_body, pad.center)
    hand.pad_normals[f] = last_from_body[:3, :3] @ pad.normal
    hand.pad_radii[f] = pad.radius
    hand.pad_angle_scales[f] = 1.0 if pad.max_angle is None else pad.max_angle / PAD_ANGLE_LIMIT


def _place(
    model: HandModel, link: int, places: dict[int, tuple[int, int, Array]], still: Array
) -> tuple[int, int, Array]:
    """Finger and joint that carry a link, and ``joint_from_link``; fixed links hang on others."""
    carrier = next((other for other in reversed(model.path(link)) if other in places), None)
    if carrier is None:
        return -1, 0, still[link]
    finger, joint, joint_from_carrier = places[carrier]
    if carrier == link:
        return finger, joint, joint_from_carrier
    return finger, joint, joint_from_carrier @ np.linalg.inv(still[carrier]) @ still[link]


def _set_shape(hand: np.record, k: int, shape: Shape, link_from_shape: Array) -> None:
    """Shape ``k`` and the spheres that cover it."""
    hand.shape_kinds[k], hand.shape_sizes[k, : len(shape.size)] = shape.kind, shape.size
    hand.shape_rotations[k], hand.shape_positions[k] = link_from_shape[:3, :3], link_from_shape[:3, 3]
    centers, radius, inside = covering_spheres(shape.kind, shape.size)
    hand.shape_radii[k] = bounding_radius(shape.kind, shape.size)
    first, last = hand.sphere_count, hand.sphere_count + len(centers)
    if last > MAX_SPHERES:
        raise HandError(
            f"The hand's shapes need more than {MAX_SPHERES} covering spheres; merge thin shapes into fewer."
        )
    hand.sphere_shapes[first:last] = k
    hand.sphere_radii[first:last], hand.sphere_insides[first:last] = radius, inside
    hand.sphere_centers[first:last] = transform_points(link_from_shape, centers)
    hand.sphere_count = hand.sphere_starts[k + 1] = last
