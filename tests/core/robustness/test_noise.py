import math

import numpy as np
import pytest

from fingersplit.errors import SettingsError
from fingersplit.robustness.noise import NoiseModel


def test_draws_have_the_stated_size():
    noise = NoiseModel(position=4e-3, rotation=0.1)
    draws = noise.draw(20_000, seed=3)
    assert math.sqrt((draws.displacements**2).sum(axis=1).mean()) == pytest.approx(4e-3, rel=0.02)
    assert math.sqrt((draws.turns**2).sum(axis=1).mean()) == pytest.approx(0.1, rel=0.02)
    assert draws.displacements.std(axis=0) == pytest.approx(np.full(3, 4e-3 / math.sqrt(3)), rel=0.03)
    assert 0.6 * draws.frictions.min() == pytest.approx(0.4, abs=1e-3)
    assert 0.6 * draws.frictions.max() == pytest.approx(0.8, abs=1e-3)
    assert (draws.masses.min(), draws.masses.max()) == pytest.approx((0.7, 1.4), abs=1e-3)
    again = noise.draw(20_000, seed=3)
    assert all((a == b).all() for a, b in zip(draws, again, strict=True))
    assert (noise.draw(10, seed=4).turns != draws.turns[:10]).any()


def test_deviations_on_each_axis_add_up():
    noise = NoiseModel.per_axis(5e-3, 0.08)
    assert noise.draw(20_000, seed=0).displacements.std(axis=0) == pytest.approx(np.full(3, 5e-3), rel=0.03)
    assert noise.level > NoiseModel().level == 1.0


@pytest.mark.parametrize("values", [(-1e-3, 0.1), (0.1, 0.1), (math.nan, 0.1), (1e-3, 1.0)])
def test_noise_out_of_range_is_refused(values):
    with pytest.raises(SettingsError, match="must be 0 to"):
        NoiseModel(*values)
