import numpy as np
import pytest
from scipy.special import expit

from fingersplit.errors import SettingsError
from fingersplit.hands import load_hand
from fingersplit.robustness.features import CLOSING_FEATURES, ESTIMATE_FEATURES
from fingersplit.robustness.probability_model import COEFFICIENTS, HoldModels, LogisticModel, load_models


def test_a_fit_finds_what_made_the_data():
    rng = np.random.default_rng(0)
    rows = rng.normal(3.0, 2.0, (4000, 2))
    truth = expit(0.8 * rows[:, 0] - 0.4 * rows[:, 1] - 0.5)
    model = LogisticModel.fit(("a", "b"), rows, rng.binomial(20, truth) / 20)
    assert model(rows) == pytest.approx(truth, abs=0.08)
    assert abs(model(rows).mean() - truth.mean()) < 5e-3
    flat = LogisticModel.fit(("a",), np.ones((50, 1)), np.full(50, 0.7))
    assert flat(np.ones((1, 1)))[0] == pytest.approx(0.7, abs=1e-3)


def test_coefficients_come_back_from_their_file(tmp_path):
    rng = np.random.default_rng(0)
    rows, held = rng.normal(size=(60, 2)), rng.uniform(size=60)
    one, other = LogisticModel.fit(("a", "b"), rows, held), LogisticModel.fit(("c", "d"), rows, 1 - held)
    models = HoldModels(one, other, 4.0, {"objects": ["cube"]})
    models.write(tmp_path / "hand.json")
    assert HoldModels.read(tmp_path / "hand.json") == models
    for text in ("", "[]", '{"estimate": {}}'):
        (tmp_path / "hand.json").write_text(text)
        with pytest.raises(SettingsError, match="holds no coefficients"):
            HoldModels.read(tmp_path / "hand.json")


def test_shipped_coefficients_are_for_these_features():
    files = sorted(COEFFICIENTS.glob("*.json"))
    assert files
    for file in files:
        models = HoldModels.read(file)
        assert set(models.estimate.features) <= set(ESTIMATE_FEATURES)
        assert models.closings.features == CLOSING_FEATURES
        assert models.provenance["objects"]
        for tier in (models.estimate, models.closings):
            assert len(tier.features) == len(tier.means) == len(tier.scales) == len(tier.weights)


def test_hands_without_coefficients_take_general_ones():
    assert load_models(load_hand("barrett_coupled")) == load_models(load_hand("barrett"))
