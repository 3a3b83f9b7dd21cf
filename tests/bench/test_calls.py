"""How the benchmarks call the planner: fidelities, and runs that can be compared."""

import pytest

from fingersplit_bench.calls import FIDELITIES, antipodal_grasps, paired_runs, plan_once, settings_of


@pytest.fixture(scope="module")
def grasps(prepared, barrett):
    return antipodal_grasps(prepared("cylinder"), barrett, 4)


def test_fidelities_differ_and_the_paper_has_the_printed_values():
    paper, default = (settings_of(fidelity) for fidelity in FIDELITIES)
    assert (paper.time_step, paper.cpo_gain, paper.cpo_trust_region, paper.ppo_trust_region) == (0.05, 2.0, 0.15, 0.5)
    assert paper != default


def test_runs_are_paired_by_the_state_they_began_in(prepared, barrett, grasps):
    model = prepared("cylinder")
    plans = [plan_once(model, barrett, grasps, fidelity=fidelity, starts=6) for fidelity in FIDELITIES]
    pairs = paired_runs(*plans)
    assert len(pairs) == len(plans[0].runs) > 0
    for paper, default in pairs:
        assert (paper.initial.object_from_palm == default.initial.object_from_palm).all()
        assert (paper.initial.joints == default.initial.joints).all()
    fewer = plan_once(model, barrett, grasps, starts=2)
    assert len(paired_runs(plans[0], fewer)) == len(fewer.runs)


def test_threads_do_not_change_the_runs(prepared, barrett, grasps):
    model = prepared("cylinder")
    alone, together = (plan_once(model, barrett, grasps, starts=6, threads=threads) for threads in (1, 2))
    assert [a.scores.tolist() for a in alone.runs] == [b.scores.tolist() for b in together.runs]
