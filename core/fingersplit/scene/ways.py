"""How a hand gets to a grasp and away from it, as compiled code writes it."""

import numpy as np

from fingersplit.hands.limits import MAX_JOINTS

__all__ = ["BY_OBJECT", "BY_WORKSPACE", "NOTHING", "NOT_ALLOWED", "WAY", "new_way"]

NOTHING, BY_OBJECT, BY_WORKSPACE, NOT_ALLOWED = -1, -2, -3, -4
"""What is in the way besides obstacles, which are numbered from 0: nothing, the object itself, the end of the
workspace; or no direction of travel near the palm's axis is allowed."""

WAY = np.dtype(
    [
        ("known", np.bool_),
        ("joints", np.float64, MAX_JOINTS),
        ("direction", np.float64, 3),
        ("distance", np.float64),
        ("blocked_by", np.int64),
        ("retreat", np.float64, 3),
        ("retreat_distance", np.float64),
        ("retreat_blocked_by", np.int64),
    ],
    align=True,
)
"""The straight way in and the way out of one grasp.

- ``known``: whether it was looked for.
- ``joints``: opened about the grasp, for the approach (N,) [rad].
- ``direction``: unit direction of travel towards the grasp, object frame; ``distance`` that is free along it [m], and
  what ends it, if it is shorter than wanted.
- ``retreat``, ``retreat_distance``, ``retreat_blocked_by``: the same for the hand that leaves with the object.
"""


def new_way() -> np.record:
    """A ``WAY`` record."""
    way: np.record = np.rec.array(np.zeros(1, WAY))[0]
    return way
