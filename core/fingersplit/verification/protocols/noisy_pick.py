"""Picks of an object that is not quite where it was said to be."""

from dataclasses import dataclass
from math import radians
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.transforms import pose_matrix
from fingersplit.verification.protocol import setting
from fingersplit.verification.protocols.pick import Pick

__all__ = ["NoisyPick"]


@dataclass(frozen=True)
class NoisyPick(Pick):
    """Several picks, each with another error of the object's pose; passed when enough of them hold."""

    name: ClassVar[str] = "noisy_pick"

    draws: int = setting(5, "1", "Picks.", 1, 1000)
    position_noise: float = setting(
        0.005, "m", "Root mean square of the object's displacement, in all directions together.", 0.0, 0.1
    )
    rotation_noise: float = setting(radians(5.0), "rad", "Root mean square of its turn, about any axis.", 0.0, 1.0)
    noise_seed: int = setting(0, "1", "Seed of the draws; the same for every grasp.", 0, 2**31 - 1)
    least_share: float = setting(0.8, "1", "Share of the picks that must hold.", 0.0, 1.0)

    def displacements(self, center: NDArray[np.float64]) -> NDArray[np.float64]:
        """Poses (draws, 4, 4) of the object in the frame that it was said to have, turned about ``center`` (3,)."""
        rng = np.random.default_rng(self.noise_seed)
        moves = self.position_noise / np.sqrt(3.0) * rng.normal(size=(self.draws, 3))
        turns = Rotation.from_rotvec(self.rotation_noise / np.sqrt(3.0) * rng.normal(size=(self.draws, 3))).as_matrix()
        return np.array(
            [pose_matrix(turn, center - turn @ center + move) for turn, move in zip(turns, moves, strict=True)]
        )
