"""Which fingers of a hand make two jaws, and in which frame."""

import math
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.spatial.transform import Rotation

from fingersplit.hands.draft.pad_samples import ANGLE, TOLERANCE, WIDTHS, PadSamples

__all__ = ["Jaws", "find_jaws"]

Array = NDArray[np.float64]

GROWN, FEW = (0, 1, 2), 20
"""Cells by which the places of pads are grown, one after the other, until so many jaw centres are found."""
TILTS, LATERAL_TILTS = np.deg2rad([-40, -20, 0, 20, 40]), np.deg2rad([-30, -15, 0, 15, 30])
NUDGES = np.deg2rad([-8, 0, 8])
"""Angles about the lateral axis and about the approach axis that are tried, and those about all axes after that."""
SPACINGS = np.array([0.02, 0.025, 0.03, 0.035, 0.04, 0.05, 0.06, 0.07, 0.08])
"""Lateral distances between two fingers of one jaw that are tried [m]."""
REACH = 0.3
"""[m]; the grid of pad places goes so far about the palm's origin on every side."""
FAR, GOOD = 3.0, 0.2
"""Pads so many tolerances from their place count nothing; a cell with this share of the best one's nearness is good."""
MAX_STANDOFFS = 0.06
"""[m]; the Map looks at eleven standoffs, so a longer range is looked at too coarsely."""


@dataclass(frozen=True, eq=False)
class Jaws:
    """Two jaws and their frame.

    Attributes:
        fingers: Indices of the fingers of both jaws.
        rotation: ``palm_from_gripper``, columns lateral, jaw (from jaw 1 to jaw 0), approach, (3, 3).
        center: Jaw centre along the lateral and the jaw axis, (2,) [m].
        standoff: Lowest and highest jaw centre along the approach axis [m].
        opening: Least and largest distance of the contacts [m].
        spacing: Lateral distance of neighbours in a jaw [m].
        score: Cells of opening and standoff by how near all pads get to their places there.
    """

    fingers: tuple[tuple[int, ...], tuple[int, ...]]
    rotation: Array
    center: Array
    standoff: tuple[float, float]
    opening: tuple[float, float]
    spacing: float
    score: float


def find_jaws(
    pads: list[PadSamples],
    fingers: tuple[tuple[int, ...], tuple[int, ...]],
    pairs: dict[tuple[int, int], Array],
    out: Array,
    width: float,
) -> Jaws | None:
    """The frame in which two jaws of fingers reach most cells of opening and standoff; None when they reach none.

    Args:
        pads: Of every finger.
        fingers: Of the two jaws.
        pairs: From ``opposition``.
        out: Direction out of the palm, (3,), about which approach directions are tried.
        width: Room that a finger needs beside another one [m].
    """
    rows = np.vstack(
        [
            pairs[min(i, j), max(i, j)] * ([1, 1, 1, 1, 1, 1] if i < j else [1, 1, 1, -1, -1, -1])
            for i in fingers[0]
            for j in fingers[1]
        ]
    )
    if len(rows) < 5:
        return None
    directions = rows[:, 3:]
    jaw = _mode(directions)
    middle = np.median(rows[:, :3][directions @ jaw > math.cos(ANGLE)], axis=0)
    ahead = out - (out @ jaw) * jaw
    if np.linalg.norm(ahead) < 0.2:
        ahead = middle - (middle @ jaw) * jaw
    ahead /= np.linalg.norm(ahead)
    base = np.column_stack([np.cross(jaw, ahead), jaw, ahead])
    tilted = [base @ Rotation.from_euler("xz", angles).as_matrix() for angles in product(TILTS, LATERAL_TILTS)]
    spacings = SPACINGS[min(width, SPACINGS[-1]) <= SPACINGS] if max(map(len, fingers)) > 1 else SPACINGS[:1]
    for grown in GROWN:
        found = _frames(pads, fingers, tilted, middle, grown, spacings)
        if found and (max(jaws.score for jaws in found) >= FEW or grown == GROWN[-1]):
            best = max((_rated(pads, jaws) for jaws in found), key=_score)
            nudged = [best.rotation @ Rotation.from_euler("xyz", a).as_matrix() for a in product(NUDGES, repeat=3)]
            found = _frames(pads, fingers, nudged, middle, grown, spacings)
            best = max((best, *(_rated(pads, jaws) for jaws in found)), key=_score)
            return _centered(pads, best)
    return None


def _score(jaws: Jaws) -> float:
    return jaws.score


def _frames(
    pads: list[PadSamples],
    fingers: tuple[tuple[int, ...], tuple[int, ...]],
    rotations: list[Array],
    middle: Array,
    grown: int,
    spacings: Array,
) -> list[Jaws]:
    """The best centre in every frame in which there is any."""
    found = (_best_cells(pads, fingers, rotation, middle, grown, spacings) for rotation in rotations)
    return [jaws for jaws in found if jaws is not None]


def _rated(pads: list[PadSamples], jaws: Jaws) -> Jaws:
    """The same jaws with a finer score: cells by how near all pads get to their places, which grown grids do not tell.

    Openings and standoffs that no pads come near to are left out at both ends.
    """
    widths = WIDTHS[(jaws.opening[0] <= WIDTHS + 1e-9) & (jaws.opening[1] >= WIDTHS - 1e-9)]
    low, high = jaws.standoff
    heights = np.linspace(low, high, max(2, _steps(high - low) + 1))
    lateral, jaw, approach = jaws.rotation.T
    middle = jaws.center[0] * lateral + jaws.center[1] * jaw + heights[:, None] * approach  # (H, 3)
    nearness = np.full((len(widths), len(heights)), np.inf)
    for side, group in ((1.0, jaws.fingers[0]), (-1.0, jaws.fingers[1])):
        for place, f in enumerate(group):
            aside = (place - (len(group) - 1) / 2) * jaws.spacing * lateral
            places = middle + aside + side / 2 * widths[:, None, None] * jaw  # (W, H, 3)
            targets = np.concatenate([places / TOLERANCE, np.broadcast_to(-side * jaw / ANGLE, places.shape)], axis=-1)
            distances, _ = pads[f].tree.query(targets, distance_upper_bound=FAR)
            nearness = np.minimum(nearness, np.exp(-(distances**2)))
    good = nearness > GOOD * nearness.max()
    rows, columns = np.flatnonzero(good.any(axis=1)), np.flatnonzero(good.any(axis=0))
    if not len(rows) or nearness.max() == 0:
        return replace(jaws, score=0.0)
    opening = (jaws.opening[0] if rows[0] == 0 else float(widths[rows[0]]), float(widths[rows[-1]]) + 0.01)
    first, last = max(columns[0] - 1, 0), min(columns[-1] + 1, len(heights) - 1)
    return replace(
        jaws,
        score=float(nearness.sum()),
        opening=opening,
        standoff=(float(heights[first]), float(heights[last])),
    )


def _centered(pads: list[PadSamples], jaws: Jaws) -> Jaws:
    """The same jaws, shifted by half a cell where that brings pads nearer to their places."""
    shifts = product((0.0, -TOLERANCE / 2, TOLERANCE / 2), repeat=2)
    return max((_rated(pads, replace(jaws, center=jaws.center + shift)) for shift in shifts), key=_score)


def _mode(directions: Array) -> Array:
    """The direction with most others within the tolerance, averaged over them."""
    some = directions[:: max(1, len(directions) // 1500)]
    near = some @ some.T > math.cos(ANGLE)
    center = some[near.sum(axis=1).argmax()]
    mean = directions[directions @ center > math.cos(ANGLE)].mean(axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def _best_cells(
    pads: list[PadSamples],
    fingers: tuple[tuple[int, ...], tuple[int, ...]],
    rotation: Array,
    middle: Array,
    grown: int,
    spacings: Array,
) -> Jaws | None:
    """Centre, openings and standoffs in one frame, by shifting grids of where each pad can be over each other."""
    origin = middle @ rotation
    grids = {}
    for side, group in ((-1.0, fingers[0]), (1.0, fingers[1])):
        for f in group:
            grid = _occupied(pads[f], rotation, side, origin)
            if not grid.any():
                return None
            grids[f] = binary_dilation(grid, iterations=grown) if grown else grid
    middles = {f: float(np.nonzero(grid)[0].mean()) for f, grid in grids.items()}
    first, second = (tuple(sorted(group, key=middles.__getitem__)) for group in fingers)
    ordered = (first, second)
    best: Jaws | None = None
    for spacing in spacings:
        hits = [_reached(grids, ordered, spacing, width) for width in WIDTHS]
        cells = np.stack(hits)  # (W, x, y, z)
        score = _windowed(cells.sum(axis=0))
        x, y, z = np.unravel_index(score.argmax(), score.shape)
        total = float(score[x, y, z])
        if total == 0 or (best is not None and total <= best.score):
            continue
        window = cells[:, x, y, z : z + _steps(MAX_STANDOFFS) + 1]
        heights, widths = np.flatnonzero(window.any(axis=0)) + z, WIDTHS[window.any(axis=1)]
        low = origin - REACH / 2
        best = Jaws(
            fingers=ordered,
            rotation=rotation,
            center=np.array([low[0] + x * TOLERANCE, low[1] + y * TOLERANCE]),
            standoff=(float(low[2] + heights[0] * TOLERANCE), float(low[2] + (heights[-1] + 1) * TOLERANCE)),
            opening=(0.0 if widths[0] <= WIDTHS[1] else float(widths[0]) - 0.01, float(widths[-1]) + 0.01),
            spacing=float(spacing),
            score=total,
        )
    return best


def _steps(length: float) -> int:
    return round(length / TOLERANCE)


def _windowed(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Sum over the standoffs of one range that starts at each height."""
    padded = np.concatenate([np.zeros((*counts.shape[:2], 1), counts.dtype), np.cumsum(counts, axis=2)], axis=2)
    length = min(_steps(MAX_STANDOFFS), counts.shape[2])
    return np.asarray(padded[:, :, length:] - padded[:, :, :-length])


def _occupied(pad: PadSamples, rotation: Array, side: float, origin: Array) -> NDArray[np.bool_]:
    """Cells of a grid in which a pad has been with its normal along ``side`` times the jaw axis."""
    facing = pad.free & (side * (pad.normals @ rotation[:, 1]) > math.cos(ANGLE))
    cells = np.floor((pad.contacts[facing] @ rotation - origin + REACH / 2) / TOLERANCE).astype(int)
    size = _steps(REACH)
    cells = cells[((cells >= 0) & (cells < size)).all(axis=1)]
    grid = np.zeros((size, size, size), bool)
    grid[tuple(cells.T)] = True
    return grid


def _reached(
    grids: dict[int, NDArray[np.bool_]], fingers: tuple[tuple[int, ...], tuple[int, ...]], spacing: float, width: float
) -> NDArray[np.bool_]:
    """Cells of a jaw centre from which every finger of both jaws, in lateral order, has its place."""
    size = _steps(REACH)
    reached = np.ones((size, size, size), bool)
    for side, group in ((1.0, fingers[0]), (-1.0, fingers[1])):
        for place, f in enumerate(group):
            aside = _steps((place - (len(group) - 1) / 2) * spacing)
            reached &= _shifted(grids[f], (aside, _steps(side * width / 2), 0))
    return reached


def _shifted(grid: NDArray[np.bool_], steps: tuple[int, int, int]) -> NDArray[np.bool_]:
    """``grid[x + steps]`` at every x; false where that is outside."""
    out = np.zeros_like(grid)
    source, target = [], []
    for step, size in zip(steps, grid.shape, strict=True):
        source.append(slice(max(step, 0), size + min(step, 0)))
        target.append(slice(max(-step, 0), size - max(step, 0)))
    out[tuple(target)] = grid[tuple(source)]
    return out
