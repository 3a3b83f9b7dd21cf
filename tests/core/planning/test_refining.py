"""Refined grasps keep every constraint, are likelier to hold, and stand beside what the splitting found."""

import numpy as np
import pytest

from fingersplit.planning.planning import plan
from fingersplit.planning.refining import candidate_of, holdings_of, refine_runs
from fingersplit.planning.search import find_grasps
from fingersplit.recording.replay import replay
from fingersplit.robustness.judging import estimate_holding
from fingersplit.robustness.noise import NoiseModel


@pytest.fixture(scope="module")
def refined(barrett, prepared):
    """Feasible runs of a mug, and the same refined."""
    model = prepared("mug")
    found = find_grasps(model, barrett, starts=8, seed=1)
    runs = [run for run in found.runs if run.feasible]
    return model, found.friction, runs, refine_runs(runs, model, found.friction, NoiseModel())


def values(runs, model, friction):
    holdings = holdings_of(runs, model, friction)
    candidates = [candidate_of(run, holding) for run, holding in zip(runs, holdings, strict=True)]
    return estimate_holding(runs[0].hand, model, candidates, friction, NoiseModel()), holdings


def test_moves_keep_constraints_and_gain(refined, exact_mesh):
    model, friction, runs, better = refined
    before, held_before = values(runs, model, friction)
    after, held_after = values(better, model, friction)
    moved = [run is not one for run, one in zip(runs, better, strict=True)]
    assert any(moved)
    assert (after >= before).all()
    assert (after[moved] > before[moved]).all()
    for one, run, old, new in zip(better, runs, held_before, held_after, strict=True):
        assert one.feasible
        assert new.margin >= old.margin
        assert one.refined_from in (None, run)
        distances = exact_mesh(model.mesh).distance(one.final.contacts)
        assert distances.max() < 1e-4
        assert one.final.residuals.max() <= one.problem.settings.contact_tolerance
        joints = one.final.joints
        assert ((joints >= one.hand.lower - 1e-9) & (joints <= one.hand.upper + 1e-9)).all()


def test_a_result_has_both_grasps_and_can_be_replayed(barrett, prepared):
    model = prepared("mug")
    result = plan(model, barrett, starts=8, seed=1, top_k=4, refine=True)
    plain = plan(model, barrett, starts=8, seed=1, top_k=64)
    changed = [grasp for grasp in result.grasps if grasp.split_grasp is not None]
    assert changed
    assert result.provenance.ranking["refine"]
    for grasp in changed:
        assert grasp.joints != grasp.split_grasp.joints
        assert grasp.p_hold.value > 0.0
    known = [np.array(list(grasp.joints.values())) for grasp in plain.grasps]
    split = np.array(list(changed[0].split_grasp.joints.values()))
    assert min(np.abs(split - one).max() for one in known) < 1e-9
    assert len(replay(result, changed[0].rank, model, barrett).trace) > 0
