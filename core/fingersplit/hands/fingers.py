"""Fingers of a model: the chains of joints from the palm to their pads."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.description import FingerDescription, HandDescription, PadDescription
from fingersplit.hands.limits import MAX_CHAIN_JOINTS
from fingersplit.hands.model import HandModel
from fingersplit.hands.tree import Tree
from fingersplit.transforms import rotation_from_wxyz

__all__ = ["Chain", "Pad", "read_fingers"]


@dataclass(frozen=True, eq=False)
class Pad:
    """A spherical cap.

    Attributes:
        link: Link that carries it.
        center: Centre of its sphere in the link's frame, (3,) [m].
        normal: Unit vector out of its middle, in the link's frame, (3,).
        radius: Radius of the sphere [m].
        max_angle: Largest angle of a contact's normal to the pad's [rad]; None where the planner decides.
    """

    link: int
    center: NDArray[np.float64]
    normal: NDArray[np.float64]
    radius: float
    max_angle: float | None


@dataclass(frozen=True, eq=False)
class Chain:
    """A finger: its name, its joints from the palm outwards, and its pads."""

    name: str
    joints: tuple[int, ...]
    pads: tuple[Pad, ...]


def read_fingers(model: Any, tree: Tree, hand: HandModel, description: HandDescription) -> tuple[Chain, ...]:
    """Every finger of the description.

    Raises:
        HandError: A pad that is nowhere, off its finger's last link or not below the palm; a finger of too many joints,
            or of none; a joint that belongs to no finger.
    """
    chains = tuple(_read_finger(model, tree, hand, finger) for finger in description.fingers)
    reached = {j for chain in chains for j in chain.joints}
    for j, joint in enumerate(hand.joints):
        if j not in reached:
            raise HandError(
                f"Joint {joint.name!r} is part of no finger; list its finger under [[fingers]], "
                "or fix it under [fixed]."
            )
    return chains


def _read_finger(model: Any, tree: Tree, hand: HandModel, finger: FingerDescription) -> Chain:
    pads = tuple(_read_pad(model, tree, hand, finger.name, pad) for pad in finger.pads)
    paths = {tuple(j for link in hand.path(pad.link) for j in hand.links[link].joints) for pad in pads}
    if len(paths) > 1:
        raise HandError(f"The pads of {finger.name!r} must all move with its last joint.")
    (joints,) = paths
    if not joints:
        raise HandError(f"No joint lies between the palm and the pads of {finger.name!r}.")
    if len(joints) > MAX_CHAIN_JOINTS:
        raise HandError(
            f"{finger.name!r} has {len(joints)} joints; fingers of up to {MAX_CHAIN_JOINTS} are planned for."
        )
    return Chain(finger.name, joints, pads)


def _read_pad(model: Any, tree: Tree, hand: HandModel, finger: str, pad: PadDescription) -> Pad:
    if pad.site is not None:
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, pad.site)
        if site < 0:
            raise HandError(f"The pad of {finger!r} is at the site {pad.site!r}, which the model does not have.")
        body = int(model.site_bodyid[site])
        if body not in tree.link_of_body:
            raise HandError(f"Site {pad.site!r} of {finger!r} does not hang below the palm.")
        normal = rotation_from_wxyz(model.site_quat[site])[:, 2]
        radius = float(model.site_size[site, 0]) if pad.radius is None else pad.radius
        return Pad(tree.link_of_body[body], model.site_pos[site].copy(), normal, radius, pad.max_angle)
    assert pad.body is not None
    assert pad.radius is not None
    link = hand.link_index(pad.body)
    if link is None:
        known = ", ".join(link.name for link in hand.links)
        raise HandError(f"The pad of {finger!r} is on the body {pad.body!r}; the bodies below the palm are {known}.")
    normal = np.array(pad.normal)
    return Pad(link, np.array(pad.center), normal / np.linalg.norm(normal), pad.radius, pad.max_angle)
