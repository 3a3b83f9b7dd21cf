"""Random postures of a hand, and where its links then are: what every proposal of a draft is measured on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.forward import link_poses
from fingersplit.hands.model import HandModel

__all__ = ["Samples", "sample_postures"]

Array = NDArray[np.float64]

END_SHARE = 0.15
"""Share of drivers that stand at one of their ends: grasps of thin and of wide objects are there."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Postures of a hand.

    Attributes:
        drivers: Driver angles, (n, A) [rad].
        poses: ``palm_from_link`` of every link, (n, L, 4, 4).
    """

    drivers: Array
    poses: Array


def sample_postures(model: HandModel, count: int, rng: np.random.Generator) -> Samples:
    """Driver angles drawn evenly between their limits, some at the limits themselves."""
    lower, upper = model.coupling.lower, model.coupling.upper
    shares = rng.uniform(size=(count, len(lower)))
    ends = rng.uniform(size=shares.shape)
    shares = np.where(ends < END_SHARE / 2, 0.0, np.where(ends > 1 - END_SHARE / 2, 1.0, shares))
    drivers = lower + shares * (upper - lower)
    return Samples(drivers, link_poses(model, model.joints_from_drivers(drivers)))
