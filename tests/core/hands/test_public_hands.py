"""Descriptions that ship for models of others: all valid, and they load where the models are."""

from importlib.resources import files

import pytest

from fingersplit.errors import HandError
from fingersplit.hands import load_hand
from fingersplit.hands.description import description_schema, read_description
from fingersplit.hands.public_hands import described_hands
from models_folder import models_folder

FOLDERS = {"allegro_wonik": "wonik_allegro", "dexee": "shadow_dexee"}


@pytest.mark.parametrize("name", described_hands())
def test_description_is_valid_and_nobodys_draft(name):
    text = (files("fingersplit.hands") / "public" / f"{name}.toml").read_text()
    description = read_description(text, name)
    assert not description.drafted
    assert description.grips


def test_schema_names_every_table():
    assert {"palm", "fingers", "grips", "couplings", "torque_limits"} <= set(description_schema()["properties"])


@pytest.mark.parametrize(("name", "folder"), FOLDERS.items())
def test_model_of_the_user_is_found_by_folder_and_by_variable(name, folder, monkeypatch):
    models = models_folder()
    if models is None:
        pytest.skip("no folder of hand models")
    hand = load_hand(f"{name}@{models / folder}")
    assert len(hand.fingers) == 3
    monkeypatch.setenv("FINGERSPLIT_HANDS", str(models))
    assert load_hand(name).sha256 == hand.sha256


def test_model_that_is_nowhere_is_said(monkeypatch):
    monkeypatch.delenv("FINGERSPLIT_HANDS", raising=False)
    with pytest.raises(HandError, match="its model does not: write leap@FOLDER"):
        load_hand("leap")
