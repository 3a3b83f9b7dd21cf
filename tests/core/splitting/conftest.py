"""States of a hand anywhere, as the kernels read them."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import ArrayLike

from fingersplit.hands import Hand
from fingersplit.hands.kernel import move_fingers
from fingersplit.splitting.state import new_states


@pytest.fixture(scope="session")
def posed_state(barrett: Hand) -> Callable[[ArrayLike, ArrayLike], np.record]:
    """A ``STATE`` record of the Barrett hand with joints (8,) [rad] and a palm pose (4, 4)."""

    def pose(joints: ArrayLike, object_from_palm: ArrayLike) -> np.record:
        state, palm = new_states(1)[0], np.asarray(object_from_palm)
        state.joints[: len(barrett.joint_names)] = joints
        state.palm_rotation, state.palm_position = palm[:3, :3], palm[:3, 3]
        move_fingers(barrett.arrays, state)
        return state

    return pose
