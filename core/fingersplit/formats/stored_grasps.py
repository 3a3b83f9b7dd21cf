"""Stored grasps to look at again: from a result document, a DexGraspBench sample or an Isaac grasp file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import ExchangeError
from fingersplit.formats.dexgraspbench import read_dexgraspbench
from fingersplit.formats.isaac_grasp import read_isaac_grasp
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand, load_hand
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.surface_kernel import touch
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["HandState", "StoredGrasp", "StoredGrasps", "grasp_at", "read_stored_grasps"]


@dataclass(frozen=True, eq=False)
class HandState:
    """Palm pose in the object frame (4, 4), and joint angles in the hand's order (N,) [rad]."""

    object_from_palm: NDArray[np.float64]
    joints: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StoredGrasp:
    """One grasp of a file: its name there, the hand, and how it began where the file says so."""

    name: str
    final: HandState
    initial: HandState | None = None


@dataclass(frozen=True, eq=False)
class StoredGrasps:
    """What a file holds.

    Attributes:
        hand: The hand.
        object_id: Id of the object, None where the file has none that we know.
        object_scale: Factor from the object's mesh to metres.
        grasps: The grasps in the order of the file.
        friction: Friction coefficient that they were planned for, None where the file does not say.
    """

    hand: Hand
    object_id: str | None
    object_scale: float
    grasps: tuple[StoredGrasp, ...]
    friction: float | None = None


def read_stored_grasps(path: Path, hand: str) -> StoredGrasps:
    """Read a file by its ending: ``.json`` result document, ``.npy`` DexGraspBench, ``.yaml`` Isaac grasp.

    Args:
        path: The file.
        hand: Name of the hand, for files that do not say.

    Raises:
        ExchangeError: Another ending, or a file that is not what its ending says or is of another hand.
        UnknownHandError: No such hand.
    """
    readers = {".json": _from_result, ".npy": _from_dexgraspbench, ".yaml": _from_isaac, ".yml": _from_isaac}
    if path.suffix.lower() not in readers:
        raise ExchangeError(f"{path.name} ends in {path.suffix!r}; readable: {', '.join(readers)}.")
    return readers[path.suffix.lower()](path.read_bytes(), hand)


def grasp_at(model: ObjectModel, hand: Hand, state: HandState) -> Grasp:
    """The grasp of a posed hand: every pad's contact is the surface point nearest to it."""
    pose = hand.pose(state.joints, state.object_from_palm)
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
        object_from_palm=state.object_from_palm,
        joints=state.joints,
        contacts=contacts,
        normals=normals,
        fingertips=pads - radii[:, None] * np.where(outside[:, None], outwards, -outwards),
        residuals=np.abs(np.where(outside, distances, -distances) - radii),
        pad_angles=np.arccos(np.clip(-(pose.pad_normals[:fingers] * normals).sum(axis=1), -1.0, 1.0)),
    )


def _from_result(data: bytes, _hand: str) -> StoredGrasps:
    try:
        document = json.loads(data)
        hand = load_hand(document["hand"])
        grasps = tuple(
            StoredGrasp(f"rank {grasp['rank']}", _state(hand, grasp), _state(hand, grasp["initial"]))
            for grasp in document["grasps"]
        )
        friction = document.get("friction")  # which results of older versions do not say
        return StoredGrasps(
            hand, str(document["object"]["id"]), 1.0, grasps, None if friction is None else float(friction)
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ExchangeError(f"This is no result document of a plan: {error!r} where its fields are read.") from error


def _state(hand: Hand, document: Mapping[str, Any]) -> HandState:
    palm = document["palm"]
    return _hand_state(palm["position"], palm["wxyz"], [document["joints"][name] for name in hand.joint_names])


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
    state = HandState(np.linalg.inv(world_from_object) @ in_world.object_from_palm, in_world.joints)
    return StoredGrasps(hand, None, sample.object_scale, (StoredGrasp("sample", state),))


def _from_isaac(data: bytes, hand_name: str) -> StoredGrasps:
    hand, grasps = load_hand(hand_name), []
    for grasp in read_isaac_grasp(data).grasps:
        missing = sorted(set(hand.joint_names) - set(grasp.joints))
        if missing:
            raise ExchangeError(f"{grasp.name} does not say where joint {missing[0]!r} of {hand.name} stands.")
        joints = np.array([grasp.joints[name] for name in hand.joint_names])
        grasps.append(StoredGrasp(grasp.name, HandState(grasp.object_from_gripper, joints)))
    return StoredGrasps(hand, None, 1.0, tuple(grasps))


def _hand_state(position: ArrayLike, wxyz: ArrayLike, joints: ArrayLike) -> HandState:
    return HandState(
        pose_matrix(rotation_from_wxyz(wxyz), np.asarray(position, np.float64)), np.asarray(joints, np.float64)
    )
