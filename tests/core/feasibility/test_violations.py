"""The mask of violated constraints: one bit each, from the numbers of the state alone, and a sentence for every bit."""

import math

import numpy as np
import pytest

from fingersplit.feasibility.violations import Limits, describe_violations
from fingersplit.feasibility.violations_kernel import find_violations
from fingersplit.scene import Constraints
from fingersplit.scene.limits import build_limits
from fingersplit.scene.ways import new_way
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.state import new_states
from fingersplit.splitting.termination import Termination

SETTINGS = PlannerSettings()


@pytest.fixture
def state(barrett) -> np.record:
    """Joints in mid-range, everything else exactly at its bound: feasible."""
    state = new_states(1)[0]
    state.joints[:8] = (barrett.lower + barrett.upper) / 2
    state.residuals[:3], state.pad_angles[:3] = SETTINGS.contact_tolerance, SETTINGS.pad_angle_limit
    state.penetration = SETTINGS.penetration_tolerance
    return state


def found(barrett, state: np.record) -> list[Termination]:
    settings = SETTINGS.for_kernels()
    limits = build_limits(Constraints(), np.eye(4), barrett)
    mask = find_violations(barrett.arrays, settings, limits, state)
    violations = describe_violations(mask, barrett, settings, state, Limits(limits, new_way(), ("table",)))
    assert len(violations) == mask.bit_count()
    assert all(violation.sentence.endswith(".") and "allowed:" in violation.sentence for violation in violations)
    return [violation.termination for violation in violations]


def test_bounds_themselves_are_kept(barrett, state):
    assert found(barrett, state) == []
    state.joints[:8] = barrett.upper
    assert found(barrett, state) == []


@pytest.mark.parametrize("bad", [1.001, math.nan])
def test_each_constraint_is_told_by_itself(barrett, state, bad):
    """NaN, too, is a violation: nothing that could not be measured passes."""
    for name, indices, expected in (
        ("residuals", range(3), Termination.CONTACT_OFF_SURFACE),
        ("pad_angles", range(3), Termination.PAD_ANGLE_VIOLATED),
    ):
        values = getattr(state, name)
        for finger in indices:
            kept = float(values[finger])
            values[finger] *= bad
            assert found(barrett, state) == [expected]
            values[finger] = kept
    state.penetration *= bad
    assert found(barrett, state) == [Termination.IN_COLLISION]
    state.penetration = 0.0
    for joint in range(8):
        kept = float(state.joints[joint])
        state.joints[joint] = bad * (barrett.upper[joint] + 1.0)
        assert found(barrett, state) == [Termination.JOINT_LIMIT_VIOLATED]
        state.joints[joint] = kept


def test_all_at_once_are_told_in_order(barrett, state):
    state.residuals[:3], state.pad_angles[:3], state.penetration, state.joints[:8] = 1.0, 1.0, 1.0, 10.0
    expected = (
        [Termination.CONTACT_OFF_SURFACE] * 3
        + [Termination.PAD_ANGLE_VIOLATED] * 3
        + [Termination.IN_COLLISION]
        + [Termination.JOINT_LIMIT_VIOLATED] * 8
    )
    assert found(barrett, state) == expected
