"""`fingersplit plan --recording`, `record` and `review` as a user runs them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh
from rerun.chunk import RrdReader

PROGRAM = Path(sys.executable).with_name("fingersplit")


def run(*arguments, cwd):
    command = [str(PROGRAM), *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300)


def log_of(path):
    """What the log of a recording says."""
    chunks = [chunk for chunk in RrdReader(path).stream().to_chunks() if str(chunk.entity_path) == "/log"]
    batch = chunks[0].to_record_batch()
    (name,) = [name for name in batch.schema.names if name.endswith(":text")]
    return [text for row in batch.column(name).to_pylist() for text in row]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("record")
    trimesh.creation.icosphere(subdivisions=3, radius=35).export(folder / "ball.stl")  # millimetres
    trimesh.creation.icosphere(subdivisions=3, radius=36).export(folder / "other.stl")
    plan = ("plan", "ball.stl", "--unit", "mm", "--starts", 8, "--seed", 3, "--setting", "friction=0.5")
    finished = run(*plan, "--json", "ball.json", "--recording", "planned.rrd", cwd=folder)
    assert finished.returncode == 0, finished.stderr
    return folder


def test_a_stored_result_is_recorded_as_it_was_planned(folder):
    finished = run(
        "record", "ball.json", "--object", "ball.stl", "--unit", "mm", "--setting", "friction=0.5", cwd=folder
    )
    assert finished.returncode == 0, finished.stderr
    assert finished.stdout.startswith("ball.rrd: ")
    assert log_of(folder / "ball.rrd") == log_of(folder / "planned.rrd")


def test_another_rank_is_another_recording(folder):
    ranks = len(json.loads((folder / "ball.json").read_text())["grasps"])
    assert ranks > 1
    arguments = (
        "--object",
        "ball.stl",
        "--unit",
        "mm",
        "--setting",
        "friction=0.5",
        "--rank",
        2,
        "--output",
        "second.rrd",
    )
    assert run("record", "ball.json", *arguments, cwd=folder).returncode == 0
    assert log_of(folder / "second.rrd") != log_of(folder / "planned.rrd")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("ball.json", "--object", "other.stl", "--unit", "mm"), "The result is for the mesh"),
        (("ball.json", "--object", "ball.stl", "--unit", "mm", "--rank", "99"), "The result has no grasp of rank 99"),
        (
            ("ball.json", "--object", "ball.stl", "--unit", "mm", "--setting", "cpo_trust_region=0.01"),
            "does not come out again",
        ),
        (("ball.stl", "--object", "ball.stl"), "is no result document"),
    ],
)
def test_what_cannot_be_recorded_is_explained(folder, arguments, said):
    finished = run("record", *arguments, cwd=folder)
    assert finished.returncode == 2
    assert said in finished.stderr
    assert "Traceback" not in finished.stderr


def test_a_recording_without_a_display_points_to_the_browser(folder, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    finished = run("review", "planned.rrd", cwd=folder)
    assert finished.returncode == 2
    assert "/review" in finished.stderr
