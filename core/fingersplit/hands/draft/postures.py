"""Driver angles of a draft: preshapes that put pads on the jaws, and where parked fingers go."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fingersplit.hands.draft.jaws import Jaws
from fingersplit.hands.draft.pad_samples import PadSamples
from fingersplit.hands.draft.sampling import Samples
from fingersplit.hands.fingers import Pad
from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel
from fingersplit.hands.self_collision import self_collision_pairs, shape_distances

__all__ = ["finger_drivers", "park", "preshapes"]

Array = NDArray[np.float64]

OPENING_SHARES = (0.35, 0.7)
SPACING_FACTORS = (1.0, 1.4)
"""Where in the range of openings preshapes stand, and their spacings by the best one's."""
POSITION_WEIGHT, NORMAL_WEIGHT, MIDDLE_WEIGHT = 1 / 0.004, 1 / 0.4, 0.15
"""Of a pad's place [1/m], its normal, and of a driver's distance from the middle of its range in half ranges."""
INSIDE = 1e3
"""What a posture costs whose pads are inside the palm."""
TRIED = 150
"""Best postures of which the first is taken in which a finger does not meet itself or the palm."""
CLEAR_RADIUS = 0.06
"""[m]; parked fingers stay away from a ball of this radius about the jaw centre."""


def finger_drivers(model: HandModel, joints: tuple[int, ...]) -> set[int]:
    """Drivers that move a finger."""
    return {int(a) for j in joints for a in np.flatnonzero(model.coupling.matrix[j])}


def preshapes(
    model: HandModel,
    jaws: Jaws,
    pads: list[Pad],
    contacts: list[PadSamples],
    chains: list[tuple[int, ...]],
    samples: Samples,
) -> list[Array]:
    """Driver angles (A,) [rad] for two openings and, where a jaw has two fingers, two spacings."""
    spread = max(map(len, jaws.fingers)) > 1
    found: list[Array] = []
    for factor in SPACING_FACTORS if spread else SPACING_FACTORS[:1]:
        for share in OPENING_SHARES:
            width = jaws.opening[0] + share * (jaws.opening[1] - jaws.opening[0])
            angles = _posture(model, jaws, pads, contacts, chains, samples, width, jaws.spacing * factor)
            if all(np.abs(angles - other).max() > 0.05 for other in found):
                found.append(angles)
    return found


def _posture(
    model: HandModel,
    jaws: Jaws,
    pads: list[Pad],
    contacts: list[PadSamples],
    chains: list[tuple[int, ...]],
    samples: Samples,
    width: float,
    spacing: float,
) -> Array:
    targets = _targets(jaws, contacts, width, spacing)
    lower, upper = model.coupling.lower, model.coupling.upper
    start: Array = np.clip(0.0, lower, upper)
    for group in _coupled(model, chains, [f for fingers in jaws.fingers for f in fingers]):
        cost = np.where(np.all([contacts[f].free for f in group], axis=0), 0.0, INSIDE)
        drivers: set[int] = set()
        for f in group:
            point, normal = targets[f]
            cost += (np.linalg.norm(contacts[f].contacts - point, axis=1) * POSITION_WEIGHT) ** 2
            cost += (np.linalg.norm(contacts[f].normals - normal, axis=1) * NORMAL_WEIGHT) ** 2
            drivers |= finger_drivers(model, chains[f])
        columns = sorted(drivers)
        middle = (samples.drivers[:, columns] - lower[columns]) / (upper[columns] - lower[columns]) * 2 - 1
        order = np.argsort(cost + (MIDDLE_WEIGHT * middle**2).sum(axis=1))[:TRIED]
        pairs = _pairs_with_palm(model, {j for f in group for j in chains[f]})
        best = samples.drivers[_first_clear(model, samples.drivers[order], pairs, order)]
        refined = best.copy()
        refined[columns] = _refine(model, pads, targets, group, columns, best)
        start[columns] = (refined if _clear(model, refined[None], pairs)[0] else best)[columns]
    return start


def _pairs_with_palm(model: HandModel, joints: set[int]) -> NDArray[np.int64]:
    """Pairs of shapes that may not meet, one of them moved by these joints and the other by none but these."""
    pairs = self_collision_pairs(model)
    moved = [{j for each in model.path(s.link) for j in model.links[each].joints} for s in model.shapes]
    return pairs[[bool(moved[a] | moved[b]) and moved[a] | moved[b] <= joints for a, b in pairs]]


def _clear(model: HandModel, drivers: Array, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether no two of these shapes lie in each other, for each row of driver angles (n, A)."""
    if not len(pairs):
        return np.ones(len(drivers), bool)
    return np.asarray((shape_distances(model, model.joints_from_drivers(drivers), pairs) > 0).all(axis=1))


def _first_clear(model: HandModel, drivers: Array, pairs: NDArray[np.int64], order: NDArray[np.int64]) -> int:
    """The first of several postures in which nothing meets; the very first where there is none."""
    return int(order[_clear(model, drivers, pairs).argmax()])


def _refine(
    model: HandModel,
    pads: list[Pad],
    targets: dict[int, tuple[Array, Array]],
    group: list[int],
    columns: list[int],
    start: Array,
) -> Array:
    """The nearest driver angles at which pads stand and look as they should."""
    lower, upper = model.coupling.lower[columns], model.coupling.upper[columns]

    def residuals(angles: Array) -> Array:
        drivers = start.copy()
        drivers[columns] = angles
        poses = link_poses(model, model.joints_from_drivers(drivers))
        parts = [MIDDLE_WEIGHT * ((angles - lower) / (upper - lower) * 2 - 1)]
        for f in group:
            normal = poses[pads[f].link, :3, :3] @ pads[f].normal
            place = poses[pads[f].link, :3, :3] @ pads[f].center + poses[pads[f].link, :3, 3] + pads[f].radius * normal
            parts += [POSITION_WEIGHT * (place - targets[f][0]), NORMAL_WEIGHT * (normal - targets[f][1])]
        return np.concatenate(parts)

    inside = np.clip(start[columns], lower + 1e-6, upper - 1e-6)
    solved = least_squares(residuals, inside, bounds=(lower, upper), max_nfev=30)
    return np.asarray(solved.x)


def _targets(jaws: Jaws, contacts: list[PadSamples], width: float, spacing: float) -> dict[int, tuple[Array, Array]]:
    """Where each pad shall touch and look, in the palm frame."""
    lateral, jaw, approach = jaws.rotation.T
    middle = jaws.center[0] * lateral + jaws.center[1] * jaw + sum(jaws.standoff) / 2 * approach
    targets = {}
    for side, group in ((1.0, jaws.fingers[0]), (-1.0, jaws.fingers[1])):
        order = sorted(group, key=lambda f: float(np.median(contacts[f].contacts[contacts[f].free] @ lateral)))
        for place, f in enumerate(order):
            aside = (place - (len(group) - 1) / 2) * spacing
            targets[f] = middle + side * width / 2 * jaw + aside * lateral, -side * jaw
    return targets


def _coupled(model: HandModel, chains: list[tuple[int, ...]], fingers: list[int]) -> list[list[int]]:
    """Fingers in groups that share no driver."""
    groups: list[tuple[set[int], list[int]]] = []
    for f in fingers:
        drivers, members = finger_drivers(model, chains[f]), [f]
        for group in [group for group in groups if group[0] & drivers]:
            groups.remove(group)
            drivers, members = drivers | group[0], group[1] + members
        groups.append((drivers, members))
    return [members for _, members in groups]


def park(
    model: HandModel, jaws: Jaws, chains: list[tuple[int, ...]], parked: list[int], samples: Samples, count: int = 2000
) -> Array:
    """Driver angles (A,) [rad] with every parked finger as far as it gets from where the object will be."""
    lateral, jaw, approach = jaws.rotation.T
    middle = jaws.center[0] * lateral + jaws.center[1] * jaw
    ball = middle + (sum(jaws.standoff) / 2) * approach
    angles: Array = np.clip(0.0, model.coupling.lower, model.coupling.upper)
    for f in parked:
        columns = sorted(finger_drivers(model, chains[f]))
        shapes = [shape for shape in model.shapes if _moved_by(model, shape.link, chains[f])]
        centers = np.stack(
            [
                samples.poses[:count, s.link, :3, :3] @ s.pose[:3, 3] + samples.poses[:count, s.link, :3, 3]
                for s in shapes
            ],
            axis=1,
        )  # (n, K, 3)
        clear = np.minimum(np.linalg.norm(centers - ball, axis=2), 2 * CLEAR_RADIUS).min(axis=1)
        straight = np.abs(samples.drivers[:count][:, columns]).sum(axis=1)
        order = np.argsort(-(clear - 0.01 * straight))
        best = _first_clear(model, samples.drivers[order], _pairs_with_palm(model, set(chains[f])), order)
        angles[columns] = samples.drivers[best, columns]
    return angles


def _moved_by(model: HandModel, link: int, joints: tuple[int, ...]) -> bool:
    return any(j in joints for each in model.path(link) for j in model.links[each].joints)
