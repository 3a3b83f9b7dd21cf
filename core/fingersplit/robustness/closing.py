"""Kinematic closings of many grasps, and what surrounds their contacts: what `p_hold` is estimated from."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.hands.limits import MAX_FINGERS, MAX_JOINTS
from fingersplit.hands.records import POSE
from fingersplit.objects.model import ObjectModel
from fingersplit.robustness.closing_kernel import close_hands, look_around
from fingersplit.robustness.noise import Draws
from fingersplit.threads import in_threads

__all__ = ["CLOSING_MEANS", "Closable", "ClosingDraws", "close_kinematically", "surroundings"]

CLOSING_MEANS = ("all_arrive", "arriving", "cone_slack", "all_grip", "apart", "link_depth", "pad_tilt")
"""What `close_hands` writes."""
AROUND = 8e-3
"""Radius of the surroundings that count [m]."""
CLOSED = 2
"""Fewest grasps that a thread closes at a time."""

CLOSING_WORK = np.dtype(
    [
        ("shares", np.float64, MAX_FINGERS),
        ("travelled", np.float64, MAX_FINGERS),
        ("speeds", np.float64, (MAX_FINGERS, 2)),
        ("contacts", np.float64, (MAX_FINGERS, 3)),
        ("normals", np.float64, (MAX_FINGERS, 3)),
        ("hints", np.int64, MAX_FINGERS),
        ("moving", np.int8, MAX_FINGERS),
        ("touching", np.int8, MAX_FINGERS),
        ("postures", np.float64, (3, MAX_JOINTS)),
        ("palm", POSE),
        ("pose", POSE),
    ],
    align=True,
)
"""Scratch of a closing: how far each finger has closed, 1 at the planned joints and 2 at the squeeze targets; the way
of its pad [m] and that way's length by phase [m]; where it touches; joints opened, of the grasp and beyond it [rad];
the hand as planned, and about the displaced object."""


class Closable(Protocol):
    """What has a grasp and joints from which it is closed, (N,) [rad]."""

    @property
    def grasp(self) -> Grasp:
        """The grasp."""

    @property
    def opened(self) -> NDArray[np.float64]:
        """The joints."""


class ClosingDraws(NamedTuple):
    """Displacements of the object for kernels: rotations (D, 3, 3), displacements (D, 3) [m], frictions (D,)."""

    rotations: NDArray[np.float64]
    displacements: NDArray[np.float64]
    frictions: NDArray[np.float64]

    @classmethod
    def of(cls, draws: Draws, friction: float) -> "ClosingDraws":
        """Of a noise model's draws about a planned friction."""
        rotations = np.ascontiguousarray(Rotation.from_rotvec(draws.turns).as_matrix())
        return cls(rotations, draws.displacements, friction * draws.frictions)


def close_kinematically(
    hand: Hand, model: ObjectModel, planned: Sequence[Closable], draws: ClosingDraws, threads: int = 1
) -> NDArray[np.float64]:
    """Means of ``CLOSING_MEANS`` over the draws for each grasp, (n, 7)."""
    means = np.zeros((len(planned), len(CLOSING_MEANS)))
    poses = np.array([one.grasp.object_from_palm for one in planned]).reshape(-1, 4, 4)
    opened, closed = (
        np.array(rows) for rows in ([one.opened for one in planned], [one.grasp.joints for one in planned])
    )
    given = hand.arrays, model.surface, model.distance, tuple(model.center_of_mass.tolist())

    def close(part: slice) -> None:
        work = np.rec.array(np.zeros(1, CLOSING_WORK))[0]
        close_hands(*given, poses[part], opened[part], closed[part], draws, work, means[part])

    if planned:
        in_threads(close, len(planned), CLOSED, threads)
    return means


def surroundings(
    model: ObjectModel, contacts: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """About each contact (n, 3) [m]: mean angle of the normals [rad], and share of a plane's samples; (n, 2)."""
    around = np.empty((len(contacts), 2))
    look_around(model.surface, np.ascontiguousarray(contacts), np.ascontiguousarray(normals), AROUND, around)
    return around
