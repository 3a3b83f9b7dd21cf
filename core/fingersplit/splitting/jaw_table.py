"""What a hand does as a parallel gripper: joints that close on two opposite contacts, for every opening and standoff.

The Map needs an inverse kinematics of all fingers for every palm pose it looks at. In the gripper's own frame the
answer depends on the object only through the distance of the two contacts, so it is tabulated once for a hand.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.drivers import drivers_of
from fingersplit.hands.hand import Hand
from fingersplit.hands.limits import MAX_PRESHAPES, MAX_STANDOFFS
from fingersplit.splitting.jaw_table_kernel import fill_table
from fingersplit.splitting.state import new_states, new_work

__all__ = ["JawTable", "jaw_table"]

OPENINGS, STANDOFFS = 25, 11

assert STANDOFFS <= MAX_STANDOFFS


class JawTable(NamedTuple):
    """A hand as a parallel gripper: P preshapes, W openings, H standoffs.

    Attributes:
        groups: For each finger the jaw it belongs to (0 or 1), (F,) int64.
        palm_from_gripper: Rotation with columns lateral, jaw (from jaw 1 to jaw 0) and approach axis, (3, 3).
        center: Jaw centre along the lateral and the jaw axis, (2,) [m].
        openings: Distances of the two contacts, evenly spaced, (W,) [m].
        standoffs: Distances of the jaw centre along the approach axis, (H,) [m].
        drivers: Drivers that put the pads on the contacts, (P, W, H, A) [rad].
        errors: Largest distance of a pad from where it belongs, (P, W, H) [m].
        lateral_offsets: Lateral places of the fingers about the middle of their jaw, (P, F) [m].
    """

    groups: NDArray[np.int64]
    palm_from_gripper: NDArray[np.float64]
    center: NDArray[np.float64]
    openings: NDArray[np.float64]
    standoffs: NDArray[np.float64]
    drivers: NDArray[np.float64]
    errors: NDArray[np.float64]
    lateral_offsets: NDArray[np.float64]


@lru_cache(maxsize=32)
def jaw_table(hand: Hand) -> JawTable:
    """The table of a hand; takes milliseconds.

    Raises:
        HandError: The hand has more preshapes than the kernels have room for.
    """
    gripper = hand.gripper
    preshapes, fingers, drivers = len(gripper.preshapes), len(hand.fingers), int(hand.arrays.driver_count)
    if not 1 <= preshapes <= MAX_PRESHAPES:
        raise HandError(f"Hand {hand.name!r} has {preshapes} preshapes; give 1 to {MAX_PRESHAPES}.")
    table = JawTable(
        groups=gripper.groups,
        palm_from_gripper=gripper.palm_from_gripper,
        center=gripper.center,
        openings=np.linspace(*gripper.opening, OPENINGS),
        standoffs=np.linspace(*gripper.standoff, STANDOFFS),
        drivers=np.zeros((preshapes, OPENINGS, STANDOFFS, drivers)),
        errors=np.zeros((preshapes, OPENINGS, STANDOFFS)),
        lateral_offsets=np.zeros((preshapes, fingers)),
    )
    fill_table(hand.arrays, drivers_of(hand.arrays, gripper.preshapes), table, new_states(1), new_work())
    return table
