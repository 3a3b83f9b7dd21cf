"""The whole description of a hand from its model file alone, by moving it."""

import math
import shutil
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.collision_shapes import planning_shapes
from fingersplit.hands.description import FingerDescription, GripDescription, HandDescription, PadDescription
from fingersplit.hands.draft.jaws import Jaws, find_jaws
from fingersplit.hands.draft.joints import describe_joints
from fingersplit.hands.draft.pad_samples import PadSamples, opposition, pad_samples
from fingersplit.hands.draft.pads import TILTS, find_pads, tip_width
from fingersplit.hands.draft.postures import finger_drivers, park, preshapes
from fingersplit.hands.draft.sampling import Samples, sample_postures
from fingersplit.hands.draft.structure import FingerBodies, find_fingers, find_palm
from fingersplit.hands.draft.toml_writer import description_to_toml
from fingersplit.hands.files import DESCRIPTION
from fingersplit.hands.fingers import Pad
from fingersplit.hands.forward import link_poses
from fingersplit.hands.limits import MAX_CHAIN_JOINTS, MAX_FINGERS
from fingersplit.hands.model import HandModel
from fingersplit.hands.tree import compile_model

__all__ = ["draft_folder", "draft_hand"]

Array = NDArray[np.float64]

POSTURES, SEED = 30_000, 1
GRIPS = 3
"""Most sets of fingers that are proposed."""
BESIDE = 0.004
"""[m]; between two fingers side by side."""
SMALL_RANGE = 5.0
"""[degrees]; no hand closes with joints that turn less."""
MIN_OPPOSITION = 1e-3
"""Share of postures; below, two fingers are not said to oppose each other."""


def draft_hand(
    model_file: Path, root: Path, palm: str | None = None, fingers: tuple[str, ...] = ()
) -> tuple[HandDescription, tuple[str, ...]]:
    """A proposal for the description of a hand, and what a person should look at.

    Palm: the last body before the chains of joints branch. Pads: the side of each last link that faces the other
    fingertips while everything moves at random. Jaws: fingers of which postures face each other, in the frame in which
    most openings and standoffs are within their reach.

    Args:
        model_file: MJCF or URDF.
        root: Folder of its meshes.
        palm: Name of the palm's body, where a person knows better.
        fingers: Names of the fingers' last bodies, likewise.

    Raises:
        HandError: The model is no hand that can be planned with, and what would make it one.
    """
    compiled, notes = compile_model(model_file, root)
    palm = palm or find_palm(compiled)
    found = find_fingers(compiled, palm, fingers)
    if len(found) > MAX_FINGERS:
        names = ", ".join(finger.tip for finger in found)
        raise HandError(
            f"{len(found)} fingers end in {names}; name up to {MAX_FINGERS} of them with --fingers, or, if there is "
            "more than one hand, the palm of one with --palm."
        )
    description, model, assumptions = describe_joints(compiled, palm, model_file.name, found)
    tips = [_index(model, finger.tip) for finger in found]
    chains = [tuple(j for link in model.path(tip) for j in model.links[link].joints) for tip in tips]
    for finger, chain in zip(found, chains, strict=True):
        if not chain:
            raise HandError(f"{finger.name} has no hinge; fingers that slide are not planned for.")
        if len(chain) > MAX_CHAIN_JOINTS:
            raise HandError(
                f"{finger.name} has {len(chain)} joints; up to {MAX_CHAIN_JOINTS} are planned for. Leave some out of "
                "the model, or name a palm that is nearer to the fingers with --palm."
            )
    _check_ranges(model)
    samples = sample_postures(model, POSTURES, np.random.default_rng(SEED))
    grips: list[GripDescription] = []
    for tilt in TILTS:  # fingertips that stay upright while fingers swing face each other only with pads across them
        pads = find_pads(model, tips, samples, tilt)
        model = replace(model, shapes=planning_shapes(model.solids, model.links, None, tuple(pads)))
        contacts = [pad_samples(pad, samples, model) for pad in pads]
        grips = _grips(model, found, chains, pads, contacts, samples)
        if grips:
            break
    if not grips:
        raise HandError(
            "No three fingers were found to face each other in any posture. Name palm and fingers with --palm and "
            f"--fingers if these are not the fingers: {', '.join(finger.tip for finger in found)}."
        )
    finished = description.model_copy(
        update={
            "fingers": [_finger(model, finger, pad) for finger, pad in zip(found, pads, strict=True)],
            "grips": grips,
            "drafted": True,
        }
    )
    return HandDescription.model_validate(finished.model_dump()), (*notes, *assumptions, *model.notes)


def _check_ranges(model: HandModel) -> None:
    """Refuse joints that hardly turn."""
    widest = math.degrees(max(joint.upper - joint.lower for joint in model.joints))
    if widest < SMALL_RANGE:
        raise HandError(
            f"No joint turns by more than {widest:.1f} degrees. MJCF reads angles in degrees unless it has "
            '<compiler angle="radian"/>: correct the limits, or write that.'
        )


def draft_folder(
    model_file: Path, root: Path, output: Path, palm: str | None = None, fingers: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """A folder with the files of a model and a proposal for its description; returns what a person should look at.

    Args:
        model_file: MJCF or URDF, below ``root``.
        root: Folder of its files, copied unless it is ``output``.
        output: Folder to write to.
        palm: As in ``draft_hand``.
        fingers: As in ``draft_hand``.

    Raises:
        HandError: As in ``draft_hand``; or there is a description already.
    """
    if (output / DESCRIPTION).exists():
        raise HandError(f"{output / DESCRIPTION} exists; move it away before another one is proposed.")
    description, notes = draft_hand(model_file, root, palm, fingers)
    if output.resolve() != root.resolve():
        if output.resolve().is_relative_to(root.resolve()):
            raise HandError(f"{output} lies inside of the folder that is copied; choose another place for it.")
        shutil.copytree(root, output, dirs_exist_ok=True)
    place = model_file.resolve().relative_to(root.resolve()).as_posix()
    text = description_to_toml(description.model_copy(update={"model": place}), notes)
    (output / DESCRIPTION).write_text(text)
    return notes


def _index(model: HandModel, name: str) -> int:
    index = model.link_index(name)
    if index is None:
        raise HandError(f"The body {name!r} does not hang below the palm.")
    return index


def _finger(model: HandModel, finger: FingerBodies, pad: Pad) -> FingerDescription:
    numbers: dict[str, Any] = {
        "center": tuple(round(float(x), 5) for x in pad.center),
        "normal": tuple(round(float(x), 4) for x in pad.normal),
        "radius": round(pad.radius, 5),
    }
    return FingerDescription(
        name=finger.name, pads=[PadDescription(site=None, body=model.links[pad.link].name, max_angle=None, **numbers)]
    )


def _grips(
    model: HandModel,
    found: tuple[FingerBodies, ...],
    chains: list[tuple[int, ...]],
    pads: list[Pad],
    contacts: list[PadSamples],
    samples: Samples,
) -> list[GripDescription]:
    """Sets of three fingers that oppose each other, the best first, and all fingers together last."""
    shares, pairs = opposition(contacts)
    out = _out_of_palm(model, pads, samples)
    width = float(np.median([tip_width(model, pad.link) for pad in pads])) + BESIDE
    sets: list[Jaws] = []
    for three in combinations(range(len(found)), 3):
        alone = max(three, key=lambda f: sum(shares[f, g] for g in three if g != f))
        pair = tuple(f for f in three if f != alone)
        if min(shares[alone, f] for f in pair) < MIN_OPPOSITION or _half_parked(model, chains, three):
            continue
        jaws = find_jaws(contacts, (pair, (alone,)), pairs, out, width)
        if jaws is not None:
            sets.append(jaws)
    sets.sort(key=lambda jaws: -jaws.score * min(shares[jaws.fingers[1][0], f] for f in jaws.fingers[0]))
    sets = sets[: GRIPS - 1 if len(found) > 3 else GRIPS]
    if len(found) > 3:
        alone = sets[0].fingers[1][0] if sets else int(shares.sum(axis=1).argmax())
        others = tuple(f for f in range(len(found)) if f != alone and shares[alone, f] >= MIN_OPPOSITION)
        if len(others) > 2 and not _half_parked(model, chains, (*others, alone)):
            whole = find_jaws(contacts, (others, (alone,)), pairs, out, width)
            sets += [whole] if whole is not None else []
    return [_grip(model, found, chains, pads, contacts, samples, jaws) for jaws in sets]


def _half_parked(model: HandModel, chains: list[tuple[int, ...]], fingers: tuple[int, ...]) -> bool:
    """Whether a driver moves one of these fingers and one that would be parked."""
    active = set().union(*(finger_drivers(model, chains[f]) for f in fingers))
    parked = [finger_drivers(model, chain) for f, chain in enumerate(chains) if f not in fingers]
    shared = {j for f in fingers for j in chains[f]}
    return any(active & {a for a in drivers if not _only_moves(model, a, shared)} for drivers in parked)


def _only_moves(model: HandModel, driver: int, joints: set[int]) -> bool:
    return {int(j) for j in np.flatnonzero(model.coupling.matrix[:, driver])} <= joints


def _out_of_palm(model: HandModel, pads: list[Pad], samples: Samples) -> Array:
    """Direction from the palm's shapes to where the fingertips are, in the mean."""
    still = link_poses(model, model.joints_from_drivers(np.clip(0.0, model.coupling.lower, model.coupling.upper)))
    rigid = [s for s in model.shapes if not any(model.links[each].joints for each in model.path(s.link))]
    center = (
        np.mean([(still[s.link] @ s.pose)[:3, 3] for s in rigid], axis=0)
        if rigid
        else np.mean([still[pad.link][:3, 3] for pad in pads], axis=0) * 0
    )
    tips = np.mean([np.median(samples.poses[:, pad.link, :3, 3], axis=0) for pad in pads], axis=0)
    away = tips - center
    length = float(np.linalg.norm(away))
    return np.asarray(away / length) if length > 1e-3 else np.array([0.0, 0.0, 1.0])


def _grip(
    model: HandModel,
    found: tuple[FingerBodies, ...],
    chains: list[tuple[int, ...]],
    pads: list[Pad],
    contacts: list[PadSamples],
    samples: Samples,
    jaws: Jaws,
) -> GripDescription:
    names, drivers = [finger.name for finger in found], model.coupling.drivers
    active = [f for fingers in jaws.fingers for f in fingers]
    idle = [f for f in range(len(found)) if f not in active]
    moving = sorted(set().union(*(finger_drivers(model, chains[f]) for f in active)))
    resting = sorted(set().union(*(finger_drivers(model, chains[f]) for f in idle)) - set(moving)) if idle else []
    parked = park(model, jaws, chains, idle, samples)

    def rounded(angles: Array, columns: list[int]) -> dict[str, float]:
        low, high = model.coupling.lower, model.coupling.upper
        return {drivers[a]: float(np.clip(np.round(angles[a], 3), low[a], high[a])) for a in columns}

    return GripDescription(
        jaws=([names[f] for f in jaws.fingers[0]], [names[f] for f in jaws.fingers[1]]),
        pads={},
        jaw_axis=_triple(jaws.rotation[:, 1]),
        approach_axis=_triple(jaws.rotation[:, 2]),
        center=(round(float(jaws.center[0]), 4), round(float(jaws.center[1]), 4)),
        standoff=(round(jaws.standoff[0], 4), round(jaws.standoff[1], 4)),
        opening=(round(jaws.opening[0], 4), round(jaws.opening[1], 4)),
        preshapes=[rounded(angles, moving) for angles in preshapes(model, jaws, pads, contacts, chains, samples)],
        parked=rounded(parked, resting),
    )


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 4) for v in vector)
    return x, y, z
