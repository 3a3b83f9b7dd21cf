"""What `fingersplit hand check` measures of the hands that ship."""

import numpy as np
import pytest

from fingersplit.hands import available_hands, load_hand
from fingersplit.hands.check.measures import jacobian_error, kinematics_error
from fingersplit.hands.draft.sampling import sample_postures


@pytest.mark.parametrize("name", available_hands())
def test_kinematics_are_mujocos_and_jacobians_those_of_differences(name):
    hand = load_hand(name)
    samples = sample_postures(hand.model, 40, np.random.default_rng(1))
    assert kinematics_error(hand, samples) < 1e-9
    assert jacobian_error(hand, samples) < 1e-7
