"""Every hand that is known moves as MuJoCo moves it, couplings included, in ten thousand random postures."""

import numpy as np
import pytest

from fingersplit.errors import HandError
from fingersplit.hands import available_hands, load_hand
from fingersplit.hands.check.measures import pad_errors
from fingersplit.hands.draft.sampling import sample_postures
from fingersplit.hands.public_hands import described_hands
from models_folder import models_folder

POSTURES = 10_000


def check(name: str) -> None:
    hand = load_hand(name)
    samples = sample_postures(hand.model, POSTURES, np.random.default_rng(5))
    positions, jacobians = pad_errors(hand, samples)
    assert positions < 1e-9
    assert jacobians < 1e-9


@pytest.mark.parametrize("name", available_hands())
def test_pads_and_jacobians_are_mujocos(name):
    check(name)


@pytest.mark.campaign
@pytest.mark.parametrize("name", described_hands())
def test_pads_and_jacobians_of_public_models_are_mujocos(name, monkeypatch):
    folder = models_folder()
    if folder is None:
        pytest.skip("no folder of hand models")
    monkeypatch.setenv("FINGERSPLIT_HANDS", str(folder))
    try:
        load_hand(name)
    except HandError as error:
        pytest.skip(str(error))
    check(name)
