"""Resampling, normalisation and the mean over grasps, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import available_metrics
from fingersplit.contacts.wrench_space import WrenchSpace
from fingersplit_bench.calls import plan_once
from fingersplit_bench.profiles import METRICS, mean_and_deviation, metric_profiles, normalised, resampled

profiles = arrays(np.float64, st.integers(2, 40), elements=st.floats(-10, 10).map(lambda x: round(x, 3)))


@given(profile=profiles, length=st.integers(2, 80))
def test_resampling_keeps_the_ends_and_stays_inside(profile, length):
    stretched = resampled(profile, length)
    assert len(stretched) == length
    assert (stretched[0], stretched[-1]) == (profile[0], profile[-1])
    assert stretched.min() >= profile.min()
    assert stretched.max() <= profile.max()


def measure(name: str, space: WrenchSpace) -> float | None:
    return available_metrics()[name].function(GraspState(space, np.zeros(3)))


def test_resampling_is_linear_in_between():
    np.testing.assert_allclose(resampled(np.array([0.0, 1.0, 3.0]), 5), [0, 0.5, 1, 2, 3])
    line = np.linspace(-2, 5, 7)
    np.testing.assert_allclose(resampled(line, 31), np.linspace(-2, 5, 31))
    np.testing.assert_array_equal(resampled(np.array([4.0]), 3), [4, 4, 4])


@given(profile=profiles, scale=st.floats(0.1, 10), offset=st.floats(-5, 5))
def test_normalisation_forgets_scale_and_offset(profile, scale, offset):
    scaled = normalised(profile)
    if np.ptp(profile) == 0:
        assert scaled is None
        return
    assert (scaled.min(), scaled.max()) == (0, 1)
    np.testing.assert_allclose(normalised(scale * profile + offset), scaled, atol=1e-9)


def test_mean_and_deviation_over_profiles_of_different_lengths():
    rising, slow, falling, constant = np.arange(5.0), np.linspace(2, 8, 11), np.arange(3.0)[::-1], np.ones(4)
    mean, deviation, count = mean_and_deviation([rising, slow, falling, constant], length=3)
    assert count == 3
    np.testing.assert_allclose(mean, [1 / 3, 1 / 2, 2 / 3])
    np.testing.assert_allclose(deviation, [np.sqrt(2) / 3, 0, np.sqrt(2) / 3], atol=1e-12)


def test_nothing_with_a_trend_is_no_grasp_at_all():
    mean, deviation, count = mean_and_deviation([np.ones(4)], length=3)
    assert count == 0
    assert not mean.any()
    assert not deviation.any()


def test_profiles_of_a_run_end_at_its_own_metrics(prepared, barrett):
    model = prepared("sphere")
    run = plan_once(model, barrett, fidelity="paper", starts=2).runs[0]
    measured = metric_profiles(run.trace, model, 0.6)
    assert tuple(measured) == METRICS
    for profile in measured.values():
        assert profile.shape == (len(run.trace),)
    assert measured["Q"][0] == run.trace.scores[0, 0]
    last = WrenchSpace(run.trace.contacts[-1], run.trace.normals[-1], 0.6, model.center_of_mass, model.radius)
    assert measured["Q_iso"][-1] == pytest.approx(measure("isotropy", last))
    assert measured["Q_vol"][-1] == pytest.approx(measure("volume", last))
    assert measured["Ferrari-Canny"][-1] == pytest.approx(measure("ferrari_canny", last))
