"""A recording's file is closed whatever happens, and its process keeps nothing of it."""

from pathlib import Path

import pytest

from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.run_recording import record_run
from fingersplit.recording.stream import Layout, recording_file


def test_a_process_that_has_written_many_recordings_keeps_nothing_of_them(barrett, tmp_path):
    def threads():
        return len(list(Path("/proc/self/task").iterdir()))

    model, counts = prepare_object(cylinder(), "cylinder"), []
    grasp = plan(model, barrett, starts=8, top_k=1, seed=3).grasps[0]
    for _ in range(6):
        record_run(tmp_path / "run.rrd", model, barrett, grasp)
        counts.append(threads())
    assert counts[-1] <= counts[1]  # rerun itself would leave four a recording
    with pytest.raises(ZeroDivisionError), recording_file(tmp_path / "broken.rrd", Layout()):
        _ = 1 / 0
    record_run(tmp_path / "run.rrd", model, barrett, grasp)
    assert threads() <= counts[1]
