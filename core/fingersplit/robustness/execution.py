"""What a robot is told to do with a grasp."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Execution"]


class Execution(NamedTuple):
    """How a grasp is executed.

    Attributes:
        object_from_palm: The planned palm, (4, 4).
        opened: Joints from which the fingers close, (N,) [rad].
        closed: Joints of the grasp, (N,) [rad].
        pressed: Servo targets that press, (N,) [rad].
        stiffness: Of the drivers' servos that the targets are meant for, (A,) [N m/rad].
        damping: Of these servos, (A,) [N m s/rad].
    """

    object_from_palm: NDArray[np.float64]
    opened: NDArray[np.float64]
    closed: NDArray[np.float64]
    pressed: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
