"""What happened in a simulation, frame by frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SimulationFrames"]


@dataclass(frozen=True, eq=False)
class SimulationFrames:
    """What happened, about 100 frames a second; world frame, which is the object frame when the simulation starts.

    Trials follow each other: each begins where the squeeze ended, and its phases carry its name.

    Attributes:
        times: Time of each frame, (T,) [s].
        phases: Phase of each frame, an index into ``phase_names``, (T,) int64.
        phase_names: Such as ``"squeeze"``, ``"lift: hold"``.
        palm_positions: Palm origin, (T, 3) [m].
        palm_wxyz: Palm orientation, (T, 4).
        joints: Joint angles, (T, N) [rad].
        object_positions: Origin of the object frame, (T, 3) [m].
        object_wxyz: Orientation of the object, (T, 4).
        contact_positions: Where each finger presses, (T, F, 3) [m].
        contact_forces: Force of each finger on the object, zero without contact, (T, F, 3) [N].
        closing: First frame in which the hand closes; slip and turn count from it.
    """

    times: NDArray[np.float64]
    phases: NDArray[np.int64]
    phase_names: tuple[str, ...]
    palm_positions: NDArray[np.float64]
    palm_wxyz: NDArray[np.float64]
    joints: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_wxyz: NDArray[np.float64]
    contact_positions: NDArray[np.float64]
    contact_forces: NDArray[np.float64]
    closing: int = 0
