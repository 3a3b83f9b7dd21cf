"""Grasps that other tools stored, to look at again: a DexGraspBench sample or an Isaac grasp file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from fingersplit.errors import ExchangeError
from fingersplit.formats.dexgraspbench import read_dexgraspbench
from fingersplit.formats.isaac_grasp import read_isaac_grasp
from fingersplit.grasp import Grasp, HandPose
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.surface_kernel import touch
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["StoredGrasp", "StoredGrasps", "grasp_at", "read_stored_grasps"]


@dataclass(frozen=True, eq=False)
class StoredGrasp:
    """One grasp of a file: its name there, and the hand."""

    name: str
    pose: HandPose


@dataclass(frozen=True, eq=False)
class StoredGrasps:
    """What a file holds.

    Attributes:
        hand: The hand.
        object_scale: Factor from the object's mesh to metres.
        grasps: The grasps in the order of the file.
    """

    hand: Hand
    object_scale: float
    grasps: tuple[StoredGrasp, ...]


def read_stored_grasps(path: Path, hand: str) -> StoredGrasps:
    """Read a file by its ending: ``.npy`` DexGraspBench, ``.yaml`` Isaac grasp.

    Args:
        path: The file.
        hand: Name of the hand, for files that do not say.

    Raises:
        ExchangeError: Another ending, or a file that is not what its ending says or is of another hand.
        UnknownHandError: No such hand.
    """
    readers = {".npy": _from_dexgraspbench, ".yaml": _from_isaac, ".yml": _from_isaac}
    if path.suffix.lower() not in readers:
        raise ExchangeError(f"{path.name} ends in {path.suffix!r}; readable: {', '.join(readers)}.")
    return readers[path.suffix.lower()](path.read_bytes(), hand)


def grasp_at(model: ObjectModel, hand: Hand, placed: HandPose) -> Grasp:
    """The grasp of a posed hand: every pad's contact is the surface point nearest to it."""
    pose = hand.pose(placed.joints, placed.object_from_palm)
    fingers = len(hand.fingers)
    pads, radii = pose.pads[:fingers].copy(), hand.arrays.pad_radii[:fingers]
    contacts, normals = np.empty_like(pads), np.empty_like(pads)
    for finger, pad in enumerate(pads):
        _, contacts[finger] = touch(model.surface, tuple(pad.tolist()), -1)
        sample = np.argmin(np.linalg.norm(model.surface.grid.points - contacts[finger], axis=1))
        normals[finger] = model.surface.normals[sample]
    away = pads - contacts
    distances = np.linalg.norm(away, axis=1)
    outside = (away * normals).sum(axis=1) >= 0.0
    outwards = np.where(distances[:, None] > 1e-9, away / np.maximum(distances, 1e-9)[:, None], normals)
    return Grasp(
        object_from_palm=placed.object_from_palm,
        joints=placed.joints,
        contacts=contacts,
        normals=normals,
        fingertips=pads - radii[:, None] * np.where(outside[:, None], outwards, -outwards),
        residuals=np.abs(np.where(outside, distances, -distances) - radii),
        pad_angles=np.arccos(np.clip(-(pose.pad_normals[:fingers] * normals).sum(axis=1), -1.0, 1.0)),
    )


def _from_dexgraspbench(data: bytes, hand_name: str) -> StoredGrasps:
    hand, sample = load_hand(hand_name), read_dexgraspbench(data)
    names = sample.joint_names or hand.joint_names
    if len(sample.grasp) != 7 + len(names) or set(names) != set(hand.joint_names):
        raise ExchangeError(
            f"The sample's hand has {len(sample.grasp) - 7} joints; {hand.name} has {len(hand.joint_names)}: "
            f"{', '.join(hand.joint_names)}."
        )
    joints = dict(zip(names, sample.grasp[7:], strict=True))
    in_world = _hand_state(sample.grasp[:3], sample.grasp[3:7], [joints[name] for name in hand.joint_names])
    world_from_object = pose_matrix(rotation_from_wxyz(sample.object_pose[3:]), sample.object_pose[:3])
    state = HandPose(np.linalg.inv(world_from_object) @ in_world.object_from_palm, in_world.joints)
    return StoredGrasps(hand, sample.object_scale, (StoredGrasp("sample", state),))


def _from_isaac(data: bytes, hand_name: str) -> StoredGrasps:
    hand, grasps = load_hand(hand_name), []
    for grasp in read_isaac_grasp(data).grasps:
        missing = sorted(set(hand.joint_names) - set(grasp.joints))
        if missing:
            raise ExchangeError(f"{grasp.name} does not say where joint {missing[0]!r} of {hand.name} stands.")
        joints = np.array([grasp.joints[name] for name in hand.joint_names])
        grasps.append(StoredGrasp(grasp.name, HandPose(grasp.object_from_gripper, joints)))
    return StoredGrasps(hand, 1.0, tuple(grasps))


def _hand_state(position: ArrayLike, wxyz: ArrayLike, joints: ArrayLike) -> HandPose:
    return HandPose(
        pose_matrix(rotation_from_wxyz(wxyz), np.asarray(position, np.float64)), np.asarray(joints, np.float64)
    )
