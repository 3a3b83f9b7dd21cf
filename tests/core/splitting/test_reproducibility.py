"""The same starts give the same runs, bit for bit: again, in threads, alone and after others."""

import numpy as np
import pytest

from fingersplit.planning.starts import choose_starts, split_starts
from fingersplit.splitting.settings import FIDELITIES
from fingersplit.splitting.state import STATE


def ignore(stage: str, share: float) -> None:
    """No progress is shown."""


def assert_same_runs(these, those):
    """Bit for bit, but for where nearest points of links that are far from the object were last seen."""
    assert len(these) == len(those) > 0
    for this, that in zip(these, those, strict=True):
        for one, other in ((this.first, that.first), (this.last, that.last)):
            for name in STATE.names:
                near = one.clearances < np.inf if name in ("clearance_points", "clearance_normals") else ...
                np.testing.assert_array_equal(one[name][near], other[name][near], err_msg=name)
        for name in ("cost", "end", "rounds", "cpo", "ppo"):
            assert getattr(this.outcome, name) == getattr(that.outcome, name)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_same_start_gives_the_same_run_bit_for_bit(barrett, prepared, problem_of, starts_of, runs_of, fidelity):
    problem, runs = problem_of("mug", fidelity), runs_of("mug", fidelity=fidelity)
    again = split_starts(problem, prepared("mug").patches, barrett, starts_of("mug"), threads=1, report=ignore)
    assert_same_runs(again, runs)
    for this, that in zip(again, runs, strict=True):
        np.testing.assert_array_equal(this.trace.scores, that.trace.scores)
        np.testing.assert_array_equal(this.trace.joints, that.trace.joints)


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_nothing_bit_for_bit(barrett, prepared, problem_of, starts_of, threads):
    """More starts than one thread takes at a time, screened and split."""
    problem, patches = problem_of("mug"), prepared("mug").patches
    grasps = [start.parallel_grasp for start in starts_of("mug")] * 6
    one = choose_starts(problem, barrett, grasps, 80, threads=1, report=ignore)
    several = choose_starts(problem, barrett, grasps, 80, threads=threads, report=ignore)
    assert len(one) == len(several) == 80
    for this, that in zip(one, several, strict=True):
        np.testing.assert_array_equal(this.contacts, that.contacts)
        np.testing.assert_array_equal(this.choices, that.choices)
    runs = split_starts(problem, patches, barrett, one, threads=1, report=ignore)
    assert_same_runs(split_starts(problem, patches, barrett, several, threads=threads, report=ignore), runs)


def test_what_ran_before_changes_nothing(barrett, prepared, problem_of, starts_of):
    """Scratch memory is used again: a run comes out the same alone, and after others."""
    problem, patches, starts = problem_of("l_bracket"), prepared("l_bracket").patches, starts_of("l_bracket")
    runs = split_starts(problem, patches, barrett, starts[::-1], threads=1, report=ignore)
    alone = [split_starts(problem, patches, barrett, [start], threads=1, report=ignore) for start in starts[::-1]]
    assert_same_runs(runs, [run for single in alone for run in single])


def test_run_leaves_its_start_as_it_was_and_cannot_be_changed(runs_of):
    for run in runs_of("sphere"):
        before = run.first.tobytes()
        run.__dict__.pop("trace", None)
        np.testing.assert_array_equal(run.first.joints[:8], run.trace.joints[0])
        np.testing.assert_array_equal(run.first.contacts[:3], run.trace.contacts[0])
        assert run.first.tobytes() == before
        for array in (run.final.joints, run.trace.scores, run.final.contacts, run.initial.normals):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0
