"""Every hand that is there: those that ship, and those of others whose models lie in the folder of models."""

import pytest

from fingersplit.errors import HandError
from fingersplit.hands import Hand, available_hands, load_hand
from fingersplit.hands.public_hands import described_hands
from models_folder import models_folder

KNOWN_HANDS = (*available_hands(), *described_hands())


def known_hand(name: str, monkeypatch: pytest.MonkeyPatch) -> Hand:
    """The hand, or the test is skipped where its model is not there."""
    if name in available_hands():
        return load_hand(name)
    folder = models_folder()
    if folder is None:
        pytest.skip("no folder of hand models")
    monkeypatch.setenv("FINGERSPLIT_HANDS", str(folder))
    try:
        return load_hand(name)
    except HandError as error:
        pytest.skip(str(error))
