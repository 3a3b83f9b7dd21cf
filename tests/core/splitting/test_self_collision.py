"""Distances between links of a hand, against MuJoCo's for the same shapes."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.hands.self_collision import shape_distances
from fingersplit.splitting.self_collision_kernel import SELF_RANGE, measure_self_clearance
from fingersplit.splitting.state import new_work


@given(seed=st.integers(0, 2**32 - 1))
def test_clearance_of_links_is_that_of_mujoco(barrett, posed_state, seed):
    rng = np.random.default_rng(seed)
    joints = rng.uniform(barrett.lower, barrett.upper)
    state = posed_state(joints, np.eye(4))
    measure_self_clearance(barrett.arrays, state, new_work().own)
    pairs = barrett.arrays.pairs[: barrett.arrays.pair_count].astype(np.int64)
    assert len(pairs) > 0
    expected = shape_distances(barrett.model, joints, pairs).min()
    if expected > SELF_RANGE + 1e-5:
        assert state.self_clearance == math.inf
    elif expected > 1e-5:
        assert abs(state.self_clearance - expected) < 1e-5
    else:
        assert state.self_clearance < 2e-5


def test_fingers_that_cross_are_in_each_other(barrett, posed_state):
    """Both spreads turned half way round put fingers 1 and 2 behind the palm, closed ones on each other."""
    found = []
    for first in np.linspace(0, 1, 9):
        joints = barrett.lower + 0.5 * (barrett.upper - barrett.lower)
        joints[0], joints[3] = first * barrett.upper[0], first * barrett.upper[3]
        joints[[1, 4, 6]] = barrett.upper[[1, 4, 6]]
        state = posed_state(joints, np.eye(4))
        measure_self_clearance(barrett.arrays, state, new_work().own)
        found.append(float(state.self_clearance))
    assert min(found) < -1e-3
