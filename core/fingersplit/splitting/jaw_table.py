"""What a hand does as a parallel gripper: joints that close on two opposite contacts, for every opening and standoff.

The Map needs an inverse kinematics of all fingers for every palm pose it looks at. In the gripper's own frame the
answer depends on the object only through the distance of the two contacts, so it is tabulated once for a hand.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.compilation import kernel
from fingersplit.hands.hand import Hand
from fingersplit.hands.kernel import move_fingers
from fingersplit.splitting.state import new_states, new_work
from fingersplit.splitting.tracking import track
from fingersplit.vectors import dot, get, norm, subtract, vector

__all__ = ["JawTable", "jaw_table"]

OPENINGS, STANDOFFS = 25, 11
ITERATIONS = 20


class JawTable(NamedTuple):
    """A hand as a parallel gripper: P preshapes, W openings, H standoffs.

    Attributes:
        groups: For each finger the jaw it belongs to (0 or 1), (F,) int64.
        palm_from_gripper: Rotation with columns lateral, jaw (from jaw 1 to jaw 0) and approach axis, (3, 3).
        center: Jaw centre along the lateral and the jaw axis, (2,) [m].
        openings: Distances of the two contacts, evenly spaced, (W,) [m].
        standoffs: Distances of the jaw centre along the approach axis, (H,) [m].
        joints: Joint angles that put the pads on the contacts, (P, W, H, N) [rad].
        errors: Largest distance of a pad from where it belongs, (P, W, H) [m].
        asides: Lateral places of the fingers about the middle of their jaw, (P, F) [m].
    """

    groups: NDArray[np.int64]
    palm_from_gripper: NDArray[np.float64]
    center: NDArray[np.float64]
    openings: NDArray[np.float64]
    standoffs: NDArray[np.float64]
    joints: NDArray[np.float64]
    errors: NDArray[np.float64]
    asides: NDArray[np.float64]


@cache
def jaw_table(hand: Hand) -> JawTable:
    """The table of a hand; takes milliseconds."""
    gripper = hand.gripper
    preshapes, fingers, joints = len(gripper.preshapes), len(hand.fingers), len(hand.joint_names)
    table = JawTable(
        groups=gripper.groups,
        palm_from_gripper=gripper.palm_from_gripper,
        center=gripper.center,
        openings=np.linspace(*gripper.opening, OPENINGS),
        standoffs=np.linspace(*gripper.standoff, STANDOFFS),
        joints=np.zeros((preshapes, OPENINGS, STANDOFFS, joints)),
        errors=np.zeros((preshapes, OPENINGS, STANDOFFS)),
        asides=np.zeros((preshapes, fingers)),
    )
    _fill(hand.arrays, gripper.preshapes, table, new_states(1), new_work())
    return table


@kernel
def _fill(hand, preshapes, table, states, work):
    state, count = states[0], hand.joint_count
    W = table.palm_from_gripper
    lateral, jaw, approach = vector(W[:, 0]), vector(W[:, 1]), vector(W[:, 2])
    for i in range(3):
        state.palm_rotation[i, i] = 1.0
    for p in range(len(preshapes)):
        state.joints[:count] = preshapes[p]
        move_fingers(hand, state)
        _measure_asides(hand, table, p, lateral, state)
        for w in range(len(table.openings)):
            for h in range(len(table.standoffs)):
                state.joints[:count] = preshapes[p]
                for iteration in range(ITERATIONS + 1):
                    move_fingers(hand, state)
                    table.errors[p, w, h] = 0.0
                    for f in range(hand.finger_count):
                        side = 1.0 if table.groups[f] == 0 else -1.0
                        x = table.center[0] + table.asides[p, f]
                        y = table.center[1] + side * (0.5 * table.openings[w] + hand.pad_radii[f])
                        z, pad = table.standoffs[h], get(state.pads, f)
                        target = (
                            x * lateral[0] + y * jaw[0] + z * approach[0],
                            x * lateral[1] + y * jaw[1] + z * approach[1],
                            x * lateral[2] + y * jaw[2] + z * approach[2],
                        )
                        gap = subtract(target, pad)
                        table.errors[p, w, h] = max(table.errors[p, w, h], norm(gap))
                        track(hand, state, f, gap, work, work.joint_step)
                    if iteration < ITERATIONS:
                        state.joints[:] = work.joint_step
                table.joints[p, w, h] = state.joints[:count]


@kernel
def _measure_asides(hand, table, p, lateral, state):
    """Lateral place of every pad about the mean of its jaw's pads."""
    for group in range(2):
        mean, members = 0.0, 0
        for f in range(hand.finger_count):
            if table.groups[f] == group:
                mean += dot(lateral, get(state.pads, f))
                members += 1
        for f in range(hand.finger_count):
            if table.groups[f] == group:
                table.asides[p, f] = dot(lateral, get(state.pads, f)) - mean / members
