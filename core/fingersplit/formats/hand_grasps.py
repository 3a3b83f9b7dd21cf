"""Grasps of multi-fingered hands that other tools stored, to look at again."""

from dataclasses import dataclass

import numpy as np

from fingersplit.grasp import Grasp, HandPose
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.objects.surface_kernel import touch

__all__ = ["HandGrasp", "HandGrasps", "grasp_at"]


@dataclass(frozen=True, eq=False)
class HandGrasp:
    """One grasp of a file: its name there, and the hand."""

    name: str
    pose: HandPose


@dataclass(frozen=True, eq=False)
class HandGrasps:
    """What a file holds.

    Attributes:
        hand: The hand.
        object_scale: Factor from the object's mesh to metres.
        grasps: The grasps in the order of the file.
    """

    hand: Hand
    object_scale: float
    grasps: tuple[HandGrasp, ...]


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
