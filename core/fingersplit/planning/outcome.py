"""What came of a start, as compiled code writes it."""

import numpy as np

from fingersplit.scene.ways import WAY
from fingersplit.splitting.state import TIMES

__all__ = ["OUTCOME"]

OUTCOME = np.dtype(
    [
        ("cost", np.float64),
        ("violations", np.int64),
        ("end", np.int64),
        ("rounds", np.int64),
        ("cpo", np.int64),
        ("ppo", np.int64),
        ("way", WAY),
        ("times", TIMES),
        ("total", np.float64),
    ],
    align=True,
)
"""How one start went.

Cost of its mapping (infinite if it has none); the mask of constraints that its grasp violates
(``feasibility.violations_kernel``); what ended it; counts as ``split_fingers`` returns them; the way in and out of a
grasp that violates nothing else; where its time went, and the time of the splitting in all [s].
"""
