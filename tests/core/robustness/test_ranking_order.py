"""Ranked by the probability of holding, estimated or simulated, or by the margin."""

import math

import pytest

from fingersplit.errors import SettingsError
from fingersplit.planning import attempts
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps
from fingersplit.robustness.noise import NoiseModel
from fingersplit.robustness.ranking_order import RankingOrder


def keys(result, by):
    """What grasps are sorted by."""
    rows = []
    for grasp in result.grasps:
        if grasp.feasible:
            margin = grasp.metrics["holding_margin"]
            value = grasp.p_hold.value if by == "p_hold" else -math.inf if margin is None else margin
            rows.append((not grasp.carries_weight, bool(grasp.grip.supporting), -value))
    return rows


@pytest.mark.parametrize("by", ["p_hold", "holding_margin"])
def test_grasps_stand_in_the_requested_order(barrett, prepared, by):
    result = plan(prepared("mug"), barrett, starts=16, seed=1, ranking=RankingOrder(by, NoiseModel(3e-3, 0.05)))
    assert len(keys(result, by)) > 2
    assert keys(result, by) == sorted(keys(result, by))
    assert result.provenance.ranking["by"] == by
    for grasp in result.grasps:
        assert (grasp.p_hold is None) == (not grasp.feasible)
        if grasp.p_hold is not None:
            assert (grasp.p_hold.tier, grasp.p_hold.position_noise) == ("estimated", 3e-3)
            assert f"{grasp.p_hold.value:.2f}, {grasp.p_hold.robustness}" in grasp.reason


def test_with_time_for_it_the_best_are_simulated(judgeable, barrett):
    found, pieces, _ = judgeable("mug")
    ranking = RankingOrder(simulation_budget=1.0, pieces=lambda: pieces)
    result = plan(found.model, barrett, starts=16, seed=1, top_k=3, ranking=ranking)
    assert result.grasps[0].p_hold.tier == "simulated"
    assert keys(result, "p_hold") == sorted(keys(result, "p_hold"))
    assert len(result.grasps) == 3


@pytest.mark.parametrize(("promising", "budget", "starts"), [(1.1, 0.0, 8), (1.1, 0.01, 32), (0.0, 0.01, 8)])
def test_time_to_simulate_lets_a_search_go_on_for_a_likely_grasp(
    judgeable, barrett, monkeypatch, promising, budget, starts
):
    found, pieces, _ = judgeable("mug")
    monkeypatch.setattr(attempts, "PROMISING", promising)
    ranking = RankingOrder(simulation_budget=budget, pieces=lambda: pieces)
    again = find_grasps(found.model, barrett, starts=8, seed=1, top_k=1, ranking=ranking)
    assert again.grasps[0].run.feasible
    assert again.grasps[0].carries_weight
    assert again.starts == starts


def test_what_cannot_be_ranked_by_is_refused():
    with pytest.raises(SettingsError, match="rank_by is 'luck'; known: p_hold, holding_margin"):
        RankingOrder("luck")
    for budget in (-1.0, 61.0, math.nan):
        with pytest.raises(SettingsError, match="simulation budget"):
            RankingOrder(simulation_budget=budget)
    with pytest.raises(SettingsError, match="needs rank_by p_hold"):
        RankingOrder("holding_margin", simulation_budget=1.0)
