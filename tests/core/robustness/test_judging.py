"""Executions in MuJoCo, and probabilities of holding from them."""

import numpy as np
import pytest

from fingersplit.robustness.executions import Executor
from fingersplit.robustness.judging import estimate_holding, hold_probability, simulate_holding
from fingersplit.robustness.noise import Draws, NoiseModel

EXACT = Draws(np.zeros((1, 3)), np.zeros((1, 3)), np.ones(1), np.ones(1))
EXACTLY = np.zeros(3)


def executor_of(found, pieces) -> Executor:
    return Executor(found.hand, found.model, pieces, found.friction, found.model.mass)


def test_an_executed_grasp_touches_and_holds(judgeable):
    found, pieces, candidates = judgeable("mug")
    executor = executor_of(found, pieces)
    executor.place(candidates[0][1])
    closing = executor.close(EXACTLY, EXACTLY)
    assert (closing.forces > 0.3).all()
    assert closing.moved < 5e-3
    assert executor.holds(EXACT, 0)
    again = executor.close(EXACTLY, EXACTLY)
    assert (again.forces == closing.forces).all()


def test_what_is_out_of_reach_too_slippery_or_too_heavy_is_not_held(judgeable):
    found, pieces, candidates = judgeable("mug")
    executor = executor_of(found, pieces)
    executor.place(candidates[0][1])
    closing = executor.close(np.array([0.5, 0.0, 0.0]), EXACTLY)
    assert (closing.forces == 0.0).all()
    assert closing.moved == closing.turned == 0.0
    assert not executor.holds(EXACT._replace(displacements=np.full((1, 3), 0.5)), 0)
    assert not executor.holds(EXACT._replace(frictions=np.full(1, 0.02)), 0)
    assert not executor.holds(EXACT._replace(masses=np.full(1, 60.0)), 0)
    assert executor.holds(EXACT, 0)  # friction and mass are again those of the object


def test_simulation_tells_grasps_that_cannot_hold(judgeable):
    found, pieces, candidates = judgeable("mug")
    good, execution = candidates[0]
    never = execution._replace(closed=execution.opened, pressed=execution.opened)
    options = found.friction, NoiseModel(), 60.0
    values = simulate_holding(found.hand, found.model, pieces, [(good, execution), (good, never)], *options)
    assert values.keys() == {0, 1}
    assert values[0] > 0.7
    assert values[1] < 0.2  # none of 24 held; what the closings said before still counts
    assert simulate_holding(found.hand, found.model, pieces, candidates, found.friction, NoiseModel(), 0.0) == {}


def test_more_noise_is_estimated_to_hold_less(judgeable):
    found, _, candidates = judgeable("mug")
    alone = [candidate for candidate, _ in candidates]
    calm, rough = (
        estimate_holding(found.hand, found.model, alone, found.friction, noise)
        for noise in (NoiseModel(), NoiseModel.per_axis(5e-3, 0.087))
    )
    assert ((calm > 0.0) & (calm < 1.0)).all()
    assert rough.mean() < calm.mean()
    assert estimate_holding(found.hand, found.model, [], found.friction, NoiseModel()).shape == (0,)


@pytest.mark.parametrize(("value", "word"), [(0.95, "robust"), (0.85, "robust"), (0.6, "fragile"), (0.39, "futile")])
def test_probabilities_have_words(value, word):
    said = hold_probability(value, NoiseModel(2e-3, 0.03), simulated=word == "robust")
    assert (said.value, said.robustness, said.position_noise, said.rotation_noise) == (value, word, 2e-3, 0.03)
    assert said.tier == ("simulated" if word == "robust" else "estimated")
