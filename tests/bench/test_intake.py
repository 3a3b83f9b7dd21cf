"""The corpus run: every file of a folder has an outcome, whatever it does to its process."""

import numpy as np
import pytest

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_bench.intake import intake_chapter, reference_volume
from fingersplit_bench.killable import Crashed, KillableWorker, Slow
from fingersplit_bench.suite import Bench


def test_worker_outlives_what_kills_its_process():
    with KillableWorker(eval, 120.0) as worker:
        assert worker.call("6 * 7") == 42
        with pytest.raises(Crashed, match="the process ended with 3"):
            worker.call("__import__('os')._exit(3)")
        with pytest.raises(Crashed, match="ZeroDivisionError"):
            worker.call("1 / 0")
        assert worker.call("6 * 7") == 42


def test_worker_is_killed_when_it_takes_too_long():
    with KillableWorker(eval, 1.0) as worker, pytest.raises(Slow, match="over 1 s"):
        worker.call("__import__('time').sleep(3600)")


@pytest.mark.parametrize("name", ["box", "mug"])
def test_reference_volume_is_that_of_the_solid(name):
    solid = PARAMETRIC_OBJECTS[name]()
    volume, deviation = reference_volume(solid)
    assert abs(volume - solid.trimesh.volume) < 4 * deviation
    assert deviation < 0.2 * volume


def test_every_file_of_a_folder_has_an_outcome(tmp_path, barrett):
    PARAMETRIC_OBJECTS["cylinder"]().trimesh.apply_scale(1000).export(tmp_path / "in_mm.stl")
    (tmp_path / "deeper").mkdir()
    (tmp_path / "deeper" / "broken.obj").write_text("v 0,5 0 0")
    (tmp_path / "notes.txt").write_text("no object")
    points = np.random.default_rng(0).normal(size=(3000, 3))
    np.savez(tmp_path / "ball.npz", points=0.04 * points / np.linalg.norm(points, axis=1, keepdims=True))
    chapter = intake_chapter(Bench({}, barrett, tmp_path, 1, 8, note=lambda _: None, corpus=tmp_path))
    rows = {row["file"]: row for row in chapter.data["files"]}
    assert set(rows) == {"in_mm.stl", "deeper/broken.obj", "ball.npz"}
    assert (rows["in_mm.stl"]["outcome"], rows["in_mm.stl"]["unit"]) == ("planned", "mm")
    assert rows["in_mm.stl"]["volume"] == pytest.approx(PARAMETRIC_OBJECTS["cylinder"]().volume, rel=1e-4)
    assert rows["deeper/broken.obj"]["outcome"] == "refused"
    assert "comma" in rows["deeper/broken.obj"]["reason"]
    assert rows["ball.npz"]["outcome"] == "planned"
    assert "3 files: 2 planned, 1 refused." in chapter.text
