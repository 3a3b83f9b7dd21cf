"""Every metric of one finished grasp."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.metrics import WrenchSpace, ferrari_canny, isotropy, volume

__all__ = ["Metrics", "assess"]


@dataclass(frozen=True)
class Metrics:
    """Numbers that compare grasps; larger is better in each.

    Attributes:
        holding_margin: Friction force to spare at every contact while the weight is carried in the worst direction [N],
            None when no forces balance it, see ``contacts.holding``.
        quality: Q = w1 Q_o + w2 Q_h, what the splitting climbs [Fan2018].
        object_quality: w1 Q_o, twice the area of the contact triangle [m^2].
        manipulability: w2 Q_h, minus the joints' distance from mid-range.
        isotropy: Smallest over largest singular value of the grasp matrix, 0..1 [Kim2001].
        volume: Volume of the wrench ellipsoid [Li1988].
        ferrari_canny: Largest wrench resisted in every direction by unit total normal force [Ferrari1992].
    """

    holding_margin: float | None
    quality: float
    object_quality: float
    manipulability: float
    isotropy: float
    volume: float
    ferrari_canny: float

    def to_document(self) -> dict[str, Any]:
        """The same as plain JSON data."""
        return asdict(self)


def assess(space: WrenchSpace, scores: NDArray[np.float64], margin: float) -> Metrics:
    """Metrics of contacts whose Q, w1 Q_o and w2 Q_h stand first in ``scores``, and whose holding margin is known."""
    quality, object_quality, manipulability = (float(score) for score in scores[:3])
    return Metrics(
        holding_margin=margin if math.isfinite(margin) else None,
        quality=quality,
        object_quality=object_quality,
        manipulability=manipulability,
        isotropy=isotropy(space),
        volume=volume(space),
        ferrari_canny=ferrari_canny(space),
    )
