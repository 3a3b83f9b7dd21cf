"""How the section `holding` judges predictions, on made-up executions."""

import numpy as np
import pytest
from scipy.special import expit

from fingersplit.robustness.features import CLOSING_FEATURES, ESTIMATE_FEATURES
from fingersplit_bench.holding import area_under_curve, calibration_error, left_out_predictions
from fingersplit_bench.holding_labels import LEVELS, Labels


def test_area_under_curve_counts_pairs():
    values, positive = np.array([0.1, 0.4, 0.4, 0.9]), np.array([False, True, False, True])
    assert area_under_curve(values, positive) == pytest.approx(3.5 / 4)
    assert area_under_curve(-values, positive) == pytest.approx(0.5 / 4)
    assert np.isnan(area_under_curve(values, np.ones(4, bool)))


def test_calibration_error_is_that_of_the_bins():
    values = np.array([0.05, 0.05, 0.95, 0.95])
    assert calibration_error(values, np.array([0.0, 0.1, 1.0, 0.9])) == pytest.approx(0.0)
    assert calibration_error(values, np.array([0.25, 0.25, 0.95, 0.95])) == pytest.approx(0.1)


def test_predictions_do_not_know_the_object_they_are_for():
    """An object whose grasps hold although nothing speaks for it is not predicted to hold."""
    rng, names = np.random.default_rng(0), np.repeat(["a", "b", "odd"], 60)
    estimate = rng.normal(size=(180, len(LEVELS), len(ESTIMATE_FEATURES)))
    closings = rng.normal(size=(180, len(LEVELS), len(CLOSING_FEATURES)))
    closings[..., 0] = estimate[..., 0]
    truth = np.where((names == "odd")[:, None], 0.95, expit(2.0 * estimate[..., 0] - 1.0))
    held = rng.uniform(size=(180, len(LEVELS), 16)) < truth[..., None]
    predicted = left_out_predictions(Labels(names, np.ones(180, int), held, estimate, closings))
    known = names != "odd"
    for tier, values in predicted.items():
        assert np.corrcoef(values[known].ravel(), truth[known].ravel())[0, 1] > 0.7, tier
    assert predicted["estimated"][~known].mean() < 0.6 < predicted["simulated"][~known].mean()
