"""What the probability of holding is estimated from, grasp by grasp."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.holding import GRAVITY, Holding
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.robustness.closing import CLOSING_MEANS, ClosingDraws, close_kinematically, surroundings
from fingersplit.robustness.noise import NoiseModel

__all__ = ["CLOSING_FEATURES", "ESTIMATE_FEATURES", "Candidate", "closing_features", "estimate_features"]

DRAWS, SEED = 8, 0
"""Displaced objects that the fingers are closed about, the same ones for every grasp."""
MIN_MARGIN = -3.0
"""[N]; margins below count as this."""

ESTIMATE_FEATURES = ("all_grip", "cone_slack", "mean_bend", "margin", "margin_of_weight", "noise")
"""Of the estimate: share of kinematic closings in which every finger arrives within its friction cone, and how far
inside the worst one is; mean angle of the normals about the contacts; holding margin, and over the weight; size of the
noise. More was tried (balance of the forces, pad angles, reach, weight): on objects not fitted on it lost more than it
gained."""

CLOSING_FEATURES = (
    *("all_touch", "touching", "mean_least_force", "least_force", "force_of_weight", "moved", "turned", "margin"),
    *("margin_of_weight", "noise"),
)
"""Of the simulated closings: shares of closings in which all fingers touch, and of fingers that do; least finger force
of a closing, mean and worst over them, and over the weight; how far the object was moved and turned; the rest as
above."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A grasp to be judged.

    Attributes:
        grasp: The grasp.
        opened: Joints from which the fingers close, (N,) [rad].
        holding: How it holds the object.
    """

    grasp: Grasp
    opened: NDArray[np.float64]
    holding: Holding


def estimate_features(
    hand: Hand,
    model: ObjectModel,
    candidates: Sequence[Candidate],
    friction: float,
    noise: NoiseModel,
    threads: int = 1,
) -> NDArray[np.float64]:
    """``ESTIMATE_FEATURES`` of each candidate, (n, features)."""
    draws = ClosingDraws.of(noise.draw(DRAWS, SEED), friction)
    means = close_kinematically(hand, model, candidates, draws, threads)
    contacts, normals = (
        np.concatenate(rows)
        for rows in ([one.grasp.contacts for one in candidates], [one.grasp.normals for one in candidates])
    )
    bends = surroundings(model, contacts, normals)[:, 0].reshape(len(candidates), -1).mean(axis=1)
    margins = np.array([_margins(one.holding, model.mass) for one in candidates])
    closings = means[:, [CLOSING_MEANS.index(name) for name in ESTIMATE_FEATURES[:2]]]
    return np.column_stack([closings, bends, margins, np.full(len(candidates), noise.level)])


def closing_features(
    forces: NDArray[np.float64],
    moved: NDArray[np.float64],
    turned: NDArray[np.float64],
    holding: Holding,
    mass: float,
    noise: NoiseModel,
) -> NDArray[np.float64]:
    """``CLOSING_FEATURES`` of a grasp.

    Args:
        forces: Force of each finger after each closing, (C, F) [N].
        moved: How far each closing moved the object, (C,) [m].
        turned: How far it turned the object, (C,) [rad].
        holding: How the grasp holds the object as planned.
        mass: Of the object [kg].
        noise: The noise.
    """
    least = forces.min(axis=1)
    return np.array(
        [
            (forces > 0.0).all(axis=1).mean(),
            (forces > 0.0).mean(),
            np.log1p(least).mean(),
            np.log1p(least.min()),
            np.log1p(least / (mass * GRAVITY)).mean(),
            1e2 * moved.mean(),
            turned.mean(),
            *_margins(holding, mass),
            noise.level,
        ]
    )


def _margins(holding: Holding, mass: float) -> tuple[float, float]:
    """Holding margin in newtons and over the weight, large ones compressed."""
    margin = max(holding.margin, MIN_MARGIN)
    return float(np.arcsinh(margin)), float(np.arcsinh(margin / (mass * GRAVITY)))
