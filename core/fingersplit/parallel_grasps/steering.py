"""Parallel grasps turned to where a request lets the hand come from."""

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.grasp_set import ParallelGrasps
from fingersplit.parallel_grasps.steering_kernel import rate_approaches
from fingersplit.scene.preparing import PreparedScene

__all__ = ["keep_possible", "steer_grasps"]

TURNS = 24
"""Approaches about the jaw axis that are rated."""
MIN_APPROACHES, MAX_APPROACHES = 4, 8
"""Of one pair."""
BESIDE_CONE = 0.3
"""[rad]; a hand may travel beside its axis, so that axes outside a cone may do."""
THICKNESS = 1.5
"""Of a finger beside its contact, in radii of its pad."""


def steer_grasps(
    grasps: ParallelGrasps, scene: PreparedScene, model: ObjectModel, hand: Hand, count: int
) -> ParallelGrasps:
    """The same pairs of contacts with approaches that are allowed and where the palm has room.

    Pairs that offer no room to a finger, or lie outside the contact regions, are left out. Of the approaches of a pair
    those in a cone come first, and among them evenly turned ones.

    Args:
        grasps: Any; their approaches do not count.
        scene: What is around.
        model: The object.
        hand: The hand.
        count: About how many grasps to return, where there are as many.
    """
    if not len(grasps):
        return grasps
    _, places = np.unique(grasps.contacts.reshape(len(grasps), -1), axis=0, return_index=True)
    contacts = np.ascontiguousarray(grasps.contacts[np.sort(places)])
    ratings, directions = _rate(contacts, scene, model, hand)
    chosen: list[tuple[int, int]] = []
    possible = np.flatnonzero(np.isfinite(ratings).any(axis=1))
    each = int(np.clip(count // max(len(possible), 1), MIN_APPROACHES, MAX_APPROACHES))
    for pair in possible.tolist():
        chosen += [(pair, turn) for turn in _spread_turns(ratings[pair], each)]
    rows = np.array(chosen, np.int64).reshape(-1, 2)
    return ParallelGrasps(contacts[rows[:, 0]], directions[rows[:, 0], rows[:, 1]])


def keep_possible(grasps: ParallelGrasps, scene: PreparedScene) -> ParallelGrasps:
    """Those of given grasps whose approach is allowed."""
    axes, cosines = scene.limits.cone_axes[: scene.limits.cone_count], scene.limits.cone_cosines
    if not len(axes) or not len(grasps):
        return grasps
    angles = np.arccos(np.clip(grasps.approaches @ axes.T, -1.0, 1.0))  # (n, cones)
    inside = (angles <= np.arccos(np.clip(cosines[: len(axes)], -1.0, 1.0)) + BESIDE_CONE).any(axis=1)
    return ParallelGrasps(grasps.contacts[inside], grasps.approaches[inside])


def _rate(
    contacts: NDArray[np.float64], scene: PreparedScene, model: ObjectModel, hand: Hand
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    ratings, directions = np.empty((len(contacts), TURNS)), np.empty((len(contacts), TURNS, 3))
    standoff = float(np.mean(hand.gripper.standoff))
    thickness = THICKNESS * float(hand.arrays.pad_radii[: len(hand.fingers)].max())
    grid = model.surface.grid
    rate_approaches(scene.arrays, scene.limits, grid, contacts, standoff, thickness, BESIDE_CONE, ratings, directions)
    return ratings, directions


def _spread_turns(ratings: NDArray[np.float64], count: int) -> list[int]:
    """Up to ``count`` turns, as evenly as can be among the best rated."""
    inside = np.flatnonzero(ratings >= 0.0)
    turns = inside if len(inside) else np.argsort(-ratings, kind="stable")[: np.isfinite(ratings).sum()][:2]
    picked = np.unique(np.linspace(0, len(turns) - 1, min(count, len(turns))).round().astype(np.int64))
    return [int(turns[i]) for i in picked]
