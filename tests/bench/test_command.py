"""`fingersplit bench` as a user runs it: a small run on two objects, its files, and its errors."""

import json
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest
from matplotlib.image import imread

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_bench.report import FIGURES
from fingersplit_bench.sections import SECTIONS
from in_process import run_program

PROGRAM = Path(sys.executable).with_name("fingersplit")


def run(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [str(PROGRAM), "bench", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=3600)


QUICK = ("planner", "paper", "ipopt", "objects", "parallel_grasps", "recordings")
SIMULATED = ("verification", "holding", "second_engine")
"""Sections that simulate grasps for minutes."""
SIMULATED_FIGURES = {
    *("holding_rate", "convex_pieces_s", "p_hold_auc", "p_hold_calibration", "noisy_top1", "cheap_tier_ms"),
    *("simulated_tier_ms", "lift_ms", "verdict_changes", "held_per_second", "engine_agreement"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    (folder / "objects").mkdir()
    (folder / "empty").mkdir()
    for name in ("sphere", "cylinder"):
        PARAMETRIC_OBJECTS[name]().trimesh.export(folder / "objects" / f"{name}.ply")
    return folder


@pytest.fixture(scope="module")
def finished(folder) -> subprocess.CompletedProcess[str]:
    return run_sections(folder, QUICK, "out")


def run_sections(folder: Path, names: Iterable[str], report: str) -> subprocess.CompletedProcess[str]:
    options = ("--json", f"{report}.json", "--report", report, "--repeats", 1, "--starts", 4)
    return run("objects", *options, *(part for name in names for part in ("--only", name)), cwd=folder)


def test_report_and_pictures_are_written(finished, folder):
    assert (finished.returncode, finished.stderr) == (0, "")
    text = (folder / "out" / "report.md").read_text()
    assert text in finished.stdout
    titles = ("Figures", "Speed of the planner", "Preparing objects", "Parallel grasps")
    for title in (*titles, "The JSON file", "Table I:", "Table II:", "Table III:", "Beside published planners"):
        assert f"# {title}" in text
    for picture in ("quality_profile.png", "metrics.png"):
        assert f"({picture})" in text
        assert imread(folder / "out" / picture).shape[0] > 200
    assert "/tmp" not in text


def test_json_has_every_figure_of_the_sections(finished, folder):
    document = json.loads((folder / "out.json").read_text())
    assert document == json.loads((folder / "out" / "report.json").read_text())
    assert set(document["figures"]) == set(FIGURES) - SIMULATED_FIGURES
    for figure in document["figures"].values():
        assert figure["low"] <= figure["high"]
        assert figure["runs"] >= 1
    assert document["run"].pop("cpu_share") > 0
    assert document["run"] == {"objects": 2, "starts": 4, "repeats": 1}
    assert {"two_threads", "ratio"} <= set(document["figures"]["starts_per_second"]["beside"])
    assert {"ipopt_q", "default_q", "paper_q"} <= set(document["figures"]["ipopt_ratio"]["beside"])
    assert [row["name"] for row in document["sections"]["planner"]["objects"]] == ["cylinder", "sphere"]
    assert {row["object"] for row in document["sections"]["paper"]["cases"]} == {"cylinder", "sphere"}
    assert document["left_out"] == {}


@pytest.mark.campaign
def test_every_section_runs(folder):
    finished = run_sections(folder, set(SECTIONS) - set(SIMULATED), "all")
    assert (finished.returncode, finished.stderr) == (0, "")
    document = json.loads((folder / "all.json").read_text())
    assert set(document["figures"]) == set(FIGURES) - SIMULATED_FIGURES
    assert set(document["sections"]) == set(SECTIONS) - set(SIMULATED)
    assert document["left_out"] == {}


@pytest.mark.campaign
def test_top_ranked_grasps_are_lifted(folder):
    options = ("--json", "held.json", "--report", "held", "--repeats", 1, "--starts", 16)
    finished = run("objects", "--only", "verification", *options, cwd=folder)
    assert finished.returncode == 0
    rate = json.loads((folder / "held.json").read_text())["figures"]["holding_rate"]
    assert rate["beside"]["objects"] == 2
    assert rate["value"] == rate["beside"]["held"] / 2
    assert "# Verification" in (folder / "held" / "report.md").read_text()


def test_bad_input_is_exit_code_2_with_one_sentence(folder):
    for arguments, sentence in (
        (("objects", "--only", "speed"), "Error: Unknown section 'speed'; known sections: planner, paper"),
        (("empty",), "Error: empty holds no mesh"),
    ):
        refused = run_program("bench", *arguments, cwd=folder)
        assert refused.returncode == 2
        assert sentence in refused.stderr
        assert refused.stderr.count("\n") == 1
    assert run_program("bench", "nowhere", cwd=folder).returncode == 2
    assert run_program("bench", "objects", "--repeats", 0, cwd=folder).returncode == 2
