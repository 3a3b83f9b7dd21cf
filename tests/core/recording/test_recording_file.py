"""A recording's file is closed whatever happens, and its process keeps nothing of it."""

from pathlib import Path

import pytest

from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.recording_file import Layout, recording_file
from fingersplit.recording.replay import replay
from fingersplit.recording.run_recording import write_recording


def test_a_process_that_has_written_many_recordings_keeps_nothing_of_them(barrett, tmp_path):
    def threads():
        return len(list(Path("/proc/self/task").iterdir()))

    model, counts = prepare_object(cylinder(), "cylinder"), []
    replayed = replay(plan(model, barrett, starts=8, top_k=1, seed=3), 1, model, barrett)
    for _ in range(6):
        write_recording(tmp_path / "run.rrd", replayed, model, barrett)
        counts.append(threads())
    assert counts[-1] <= counts[1]  # rerun itself would leave four a recording
    with pytest.raises(ZeroDivisionError), recording_file(tmp_path / "broken.rrd", Layout()):
        _ = 1 / 0
    write_recording(tmp_path / "run.rrd", replayed, model, barrett)
    assert threads() <= counts[1]
