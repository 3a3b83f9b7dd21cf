"""What a draft says of a hand's joints: which are held, what they follow, and what the model leaves out."""

from pathlib import PurePath
from typing import Any

import numpy as np

from fingersplit.errors import HandError
from fingersplit.hands.collision_shapes import convex_solids, planning_shapes
from fingersplit.hands.couplings import read_coupling
from fingersplit.hands.description import CouplingDescription, HandDescription, ShapeOptions
from fingersplit.hands.draft.structure import FingerBodies
from fingersplit.hands.model import HandModel
from fingersplit.hands.tree import HINGE, SLIDE, read_tree

__all__ = ["describe_joints"]

ASSUMED_TORQUE = 0.7
"""[N m]; of a driver whose motor the model does not describe."""


UNNAMED = "MuJoCo Model"
"""What MuJoCo calls a model that has no name."""


def describe_joints(
    compiled: Any, palm: str, model_name: str, found: tuple[FingerBodies, ...]
) -> tuple[HandDescription, HandModel, list[str]]:
    """Links, joints and couplings, with torques, limits and passive joints filled in where the model lacks them.

    Args:
        compiled: ``MjModel`` of the hand.
        palm: Name of its palm.
        model_name: Name of the model's file.
        found: Its fingers.

    Returns:
        The description so far, the hand, and what a person should look at.
    """
    assumptions: list[str] = []
    description = HandDescription.model_construct(
        title=_title(compiled, model_name),
        model=model_name,
        palm=palm,
        fingers=[],
        grips=[],
        torque_limits={},
        couplings={},
        limits=_missing_limits(compiled, assumptions),
        fixed=_sliding(compiled, palm, assumptions) | _beside_fingers(compiled, palm, found, assumptions),
        shapes=ShapeOptions(groups=None, budget=None),
        drafted=True,
    )
    while True:
        tree = read_tree(compiled, description)
        try:
            coupling, notes = read_coupling(compiled, tree, description)
            break
        except HandError as error:
            description = _mended(description, tree, str(error), assumptions)
    solids = convex_solids(tree.collision)
    shapes = planning_shapes(solids, tree.links, None)
    model = HandModel(
        tree.links, tree.joints, coupling, solids, tree.visuals, shapes, frozenset(), tuple(notes), int(compiled.nu)
    )
    return description, model, assumptions


def _mended(description: HandDescription, tree: Any, fault: str, assumptions: list[str]) -> HandDescription:
    """The description with one gap filled that a fault names; the fault again where it cannot be."""
    names = [joint.name for joint in tree.joints]
    if fault.startswith("No torque limit is known for "):
        missing = fault.removeprefix("No torque limit is known for ").split(";")[0].split(", ")
        assumptions.append(
            f"The model says no torque for {', '.join(missing)}; {ASSUMED_TORQUE} N m is assumed. Put in the real ones."
        )
        return description.model_copy(
            update={"torque_limits": {**description.torque_limits, **dict.fromkeys(missing, ASSUMED_TORQUE)}}
        )
    passive = next((name for name in names if fault.startswith(f"Joint {name!r} is ")), None)
    before = _joint_before(tree, names.index(passive)) if passive is not None else None
    if passive is not None and before is None and passive not in description.torque_limits:
        assumptions.append(
            f"{passive} has no actuator; a motor of {ASSUMED_TORQUE} N m is assumed. Put in the real one."
        )
        limits = {**description.torque_limits, passive: ASSUMED_TORQUE}
        return description.model_copy(update={"torque_limits": limits})
    if passive is None or before is None or passive in description.couplings:
        raise HandError(fault)
    one, other = tree.joints[names.index(passive)], tree.joints[before]
    ratio = max(abs(one.lower), abs(one.upper)) / max(abs(other.lower), abs(other.upper))
    assumptions.append(
        f"{passive} has no actuator; it is taken to follow {other.name} by {ratio:.3f}. Put in the real coupling."
    )
    coupling = CouplingDescription(driver=other.name, ratio=round(ratio, 4), offset=0.0)
    return description.model_copy(update={"couplings": {**description.couplings, passive: coupling}})


def _joint_before(tree: Any, joint: int) -> int | None:
    """The joint that carries a joint's link."""
    link = next(i for i, each in enumerate(tree.links) if joint in each.joints)
    own = tree.links[link].joints
    if own[0] != joint:
        return int(own[own.index(joint) - 1])
    while tree.links[link].parent >= 0:
        link = tree.links[link].parent
        if tree.links[link].joints:
            return int(tree.links[link].joints[-1])
    return None


def _missing_limits(compiled: Any, assumptions: list[str]) -> dict[str, tuple[float, float]]:
    limits = {}
    for j in range(compiled.njnt):
        if not compiled.jnt_limited[j] and compiled.jnt_type[j] == HINGE:
            name = str(compiled.joint(j).name)
            limits[name] = (-3.1416, 3.1416)
            assumptions.append(
                f"{name} has no limits in the model; half a turn to both sides is assumed. Put in the real ones."
            )
    return limits


def _sliding(compiled: Any, palm: str, assumptions: list[str]) -> dict[str, float]:
    """Joints below the palm that slide, held where they are."""
    fixed = {}
    for j in range(compiled.njnt):
        body = int(compiled.jnt_bodyid[j])
        if compiled.jnt_type[j] == SLIDE and _hangs_below(compiled, body, palm):
            name = str(compiled.joint(j).name)
            fixed[name] = float(compiled.qpos0[compiled.jnt_qposadr[j]])
            assumptions.append(f"{name} slides, and only hinges are planned for; it is held at {fixed[name]:g} m.")
    return fixed


def _hangs_below(compiled: Any, body: int, palm: str) -> bool:
    root = 0 if palm == "world" else int(compiled.body(palm).id)
    while body not in (root, 0):
        body = int(compiled.body_parentid[body])
        if body == root:
            return True
    return False


def _beside_fingers(
    compiled: Any, palm: str, found: tuple[FingerBodies, ...], assumptions: list[str]
) -> dict[str, float]:
    """Joints below the palm that are on no finger's way, held at zero."""
    root = 0 if palm == "world" else int(compiled.body(palm).id)
    used = set()
    for finger in found:
        body = int(compiled.body(finger.tip).id)
        while body not in (root, 0):
            used.add(body)
            body = int(compiled.body_parentid[body])
    fixed = {}
    for j in range(compiled.njnt):
        body = int(compiled.jnt_bodyid[j])
        above = body
        while above not in (root, 0):
            above = int(compiled.body_parentid[above])
        if above == root and body != root and body not in used and compiled.jnt_type[j] != SLIDE:
            name = str(compiled.joint(j).name)
            fixed[name] = float(np.clip(0.0, *compiled.jnt_range[j])) if compiled.jnt_limited[j] else 0.0
            assumptions.append(f"{name} belongs to no finger; it is held at {fixed[name]:g}.")
    return fixed


def _title(compiled: Any, file: str) -> str:
    """The name that the model gives itself, or else its file's, without the suffix."""
    own = bytes(compiled.names).partition(b"\0")[0].decode(errors="replace").strip()
    return own if own not in ("", UNNAMED) else PurePath(file).stem
