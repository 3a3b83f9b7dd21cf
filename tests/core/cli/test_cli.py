"""The `fingersplit` program as a user runs it: its output, errors and exit codes; some in a process of their own."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from fingersplit.formats import available_formats
from fingersplit.formats.isaac_grasp import read_isaac_grasp
from fingersplit.parallel_grasps.sources import available_sources
from fingersplit_client.schemas import PlanResult
from in_process import run_program

PROGRAM = Path(sys.executable).with_name("fingersplit")


def start(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a command by the installed program."""
    command = [str(PROGRAM), *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("cli")
    trimesh.creation.icosphere(subdivisions=3, radius=35).export(folder / "ball.stl")  # millimetres
    trimesh.creation.icosphere(subdivisions=3, radius=36).export(folder / "egg.stl")
    trimesh.creation.box((0.4, 0.4, 0.4)).export(folder / "crate.ply")
    (folder / "broken.stl").write_bytes((folder / "ball.stl").read_bytes()[:500])
    (folder / "no.json").write_text("{not json")
    (folder / "flat.json").write_text('[{"contacts": [[0, 0, 0], [0, 0, 0]], "approach": [0, 0, 1]}]')
    (folder / "one.json").write_text('{"contacts": []}')
    pair = {"contacts": [[0.035, 0, 0], [-0.035, 0, 0]], "approach": [0, 0, -1]}
    (folder / "pair.json").write_text(json.dumps([pair]))
    return folder


def test_plan_writes_the_document_and_prints_the_table(folder):
    finished = start("plan", "ball.stl", "--unit", "mm", "--starts", 8, "--seed", 3, "--json", "plan.json", cwd=folder)
    assert finished.returncode == 0
    assert finished.stderr == ""
    document = json.loads((folder / "plan.json").read_text())
    assert PlanResult.model_validate(document).model_dump(mode="json") == document
    assert (document["hand"], document["starts"], document["seed"]) == ("barrett", 8, 3)
    assert document["object"]["name"] == "ball"
    assert document["object"]["extents"] == pytest.approx([0.07] * 3, abs=1e-3)
    assert "ball, barrett" in finished.stdout
    assert "Ferrari-Canny" in finished.stdout
    assert document["summary"]["message"] in finished.stdout
    assert "Wrote the result to plan.json." in finished.stdout
    rows = [line.rstrip() for line in finished.stdout.splitlines() if line.split()[1:2] in (["yes"], ["no"])]
    assert len(rows) == len(document["grasps"])
    for row, grasp in zip(rows, document["grasps"], strict=True):  # whole, though a pipe has only 80 columns
        assert row.endswith(grasp["termination"].replace("_", " "))
        assert f"{max(contact['pad_angle'] for contact in grasp['contacts']):.2f}" in row.split()


def test_document_on_standard_output_can_be_piped(folder):
    arguments = ("plan", "ball.stl", "--unit", "mm", "--starts", 4, "--top-k", 2, "--parallel-grasps", "pair.json")
    finished = start(*arguments, "--setting", "friction=0.5", "--json", "-", cwd=folder)
    assert finished.returncode == 0
    document = json.loads(finished.stdout)
    assert len(document["grasps"]) <= 2
    for grasp in document["grasps"]:
        assert grasp["initial"]["parallel_grasp"]["contacts"] == [[0.035, 0, 0], [-0.035, 0, 0]]
    assert "Ferrari-Canny" in finished.stderr
    assert "\r" not in finished.stderr
    assert "\x1b" not in finished.stderr + finished.stdout


def test_surface_fitting_is_a_source(folder):
    arguments = ("--unit", "mm", "--starts", 8, "--source", "surface_fitting", "--json", "fitted.json")
    finished = run_program("plan", "ball.stl", *arguments, cwd=folder)
    assert finished.returncode == 0
    grasps = json.loads((folder / "fitted.json").read_text())["grasps"]
    for grasp in grasps:
        first, second = np.array(grasp["initial"]["parallel_grasp"]["contacts"])
        assert np.linalg.norm(first - second) == pytest.approx(0.07, abs=2e-3)


def test_parallel_grasps_of_another_tool_are_counted(folder):
    pose = [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.103], [0, 0, 0, 1]]
    aside = [[1, 0, 0, 1], *pose[1:]]
    (folder / "panda.json").write_text(json.dumps({"grasps": {"transforms": [pose, aside]}}))
    finished = run_program(
        "plan", "ball.stl", "--unit", "mm", "--starts", 4, "--parallel-grasps", "panda.json", cwd=folder
    )
    assert finished.returncode in {0, 1}
    assert "GraspGen JSON with 2 grasps; contacts were found for 1 of 2." in finished.stdout


def test_result_is_exported(folder):
    if not (folder / "plan.json").exists():
        run_program("plan", "ball.stl", "--unit", "mm", "--starts", 8, "--seed", 3, "--json", "plan.json", cwd=folder)
    document = json.loads((folder / "plan.json").read_text())
    executable = [grasp for grasp in document["grasps"] if grasp["feasible"] and grasp["pregrasp"]]
    finished = run_program("export", "plan.json", "--format", "isaac_grasp", "-o", "grasps.yaml", cwd=folder)
    assert (finished.returncode, finished.stderr) == (0, "")
    assert finished.stdout.startswith("Wrote grasps.yaml. Isaac grasp YAML: rank")
    file = read_isaac_grasp(yaml.safe_load((folder / "grasps.yaml").read_bytes()))
    assert [grasp.joints for grasp in file.grasps] == [grasp["joints"] for grasp in executable]
    for arguments, sentence in (
        (("plan.json", "--format", "csv"), "Unknown format 'csv'"),
        (("no.json", "--format", "moveit"), "no.json is not JSON"),
        (("plan.json", "--format", "moveit", "--rank", 999), "none of rank 999"),
    ):
        finished = run_program("export", *arguments, "-o", "x", cwd=folder)
        assert finished.returncode == 2
        assert sentence in finished.stderr
        assert not (folder / "x").exists()


def test_no_feasible_grasp_is_exit_code_1_with_the_reason(folder):
    finished = run_program("plan", "crate.ply", "--starts", 4, "--json", "crate.json", cwd=folder)
    assert finished.returncode == 1
    assert finished.stderr == ""
    assert "No parallel grasp exists" in finished.stdout
    assert json.loads((folder / "crate.json").read_text())["grasps"] == []


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("broken.stl",), "triangle"),
        (("ball.stl", "--unit", "furlong"), "furlong"),
        (
            ("ball.stl", "--hand", "claw"),
            "Unknown hand 'claw'; known hands: allegro, barrett, barrett_coupled, three_finger.",
        ),
        (("ball.stl", "--setting", "fricton=0.4"), "Unknown planner setting 'fricton'"),
        (("ball.stl", "--setting", "friction"), "'friction' is not NAME=VALUE"),
        (("ball.stl", "--setting", "friction=much"), "'friction' must be a number, got 'much'."),
        (("ball.stl", "--setting", "fidelity=best"), "'fidelity' is 'best'; allowed: default, paper."),
        (("ball.stl", "--setting", "friction=9"), "'friction' is 9; allowed: 0.01 to 5."),
        (("ball.stl", "--unit", "mm", "--parallel-grasps", "no.json"), "no.json is not JSON"),
        (
            ("ball.stl", "--unit", "mm", "--parallel-grasps", "flat.json"),
            "The two contacts of a parallel grasp coincide",
        ),
        (("ball.stl", "--unit", "mm", "--parallel-grasps", "one.json"), "missing: 'approach'"),
        (
            ("ball.stl", "--unit", "mm", "--parallel-grasps", "pair.json", "--format", "dexnet"),
            "Dex-Net HDF5 needs hdf5.",
        ),
        (("ball.stl", "--unit", "mm", "--source", "guessing"), "known: antipodal, both, surface_fitting."),
    ],
)
def test_bad_input_is_exit_code_2_with_one_sentence(folder, arguments, sentence):
    finished = run_program("plan", *arguments, cwd=folder)
    assert finished.returncode == 2
    assert finished.stdout == ""
    assert finished.stderr.startswith("Error: ")
    assert finished.stderr.count("\n") == 1
    assert finished.stderr.endswith(".\n")
    assert sentence in finished.stderr


def test_missing_file_and_numbers_out_of_range_are_exit_code_2(folder):
    for arguments in (("nowhere.stl",), ("ball.stl", "--starts", 0), ("ball.stl", "--seed", -1)):
        finished = start("plan", *arguments, cwd=folder)
        assert finished.returncode == 2
        assert "Traceback" not in finished.stderr


def test_hands_are_listed(folder):
    finished = run_program("hands", cwd=folder)
    assert (finished.returncode, finished.stderr) == (0, "")
    lines = finished.stdout.splitlines()
    assert lines[1] == "barrett: Barrett BH8-280, eight independent joints; 3 fingers, 8 joints"
    assert [line.partition(":")[0] for line in lines[:4]] == ["allegro", "barrett", "barrett_coupled", "three_finger"]
    assert all(line.endswith("the model is yours, its description ships") for line in lines[4:])


def test_help_lists_the_commands(folder):
    finished = run_program("--help", cwd=folder)
    assert finished.returncode == 0
    for command in ("plan", "export", "hands", "warm"):
        assert command in finished.stdout


def test_help_keeps_its_units(folder):
    finished = run_program("plan", "--help", cwd=folder)
    assert "[kg/m^3]" in finished.stdout
    assert "by half [m]" in " ".join(finished.stdout.split())


@pytest.mark.parametrize(
    ("option", "sentence"),
    [
        (("--json", "nowhere/plan.json"), "nowhere/plan.json cannot be written: the folder nowhere does not exist."),
        (("--picture", "nowhere/best.png"), "the folder nowhere does not exist"),
        (("--recording", "."), ". is a folder; give the file to write."),
        (("--json", "locked/plan.json"), "locked/plan.json cannot be written: permission denied."),
        (("--verified", 1, "--protocol", "drop"), "Unknown verification protocol 'drop'"),
    ],
)
def test_what_cannot_be_done_is_refused_before_any_work(folder, option, sentence):
    locked = folder / "locked"
    locked.mkdir(exist_ok=True)
    if "locked" in str(option[1]):
        if os.geteuid() == 0:
            pytest.skip("root may write everywhere")
        locked.chmod(0o500)
    finished = run_program("plan", "broken.stl", *option, cwd=folder)  # which would be refused, were it read
    assert (finished.returncode, finished.stdout) == (2, "")
    assert finished.stderr.startswith("Error: ")
    assert sentence in finished.stderr


def test_verify_refuses_other_objects_and_other_files(folder):
    (folder / "one_grasp.npy").write_bytes(b"nonsense")
    run_program("plan", "ball.stl", "--unit", "mm", "--starts", 2, "--json", "small.json", cwd=folder)
    for arguments, sentence in (
        (("small.json", "--object", "crate.ply"), "largest extent with unit 'mm'"),
        (("small.json", "--object", "egg.stl"), "egg.stl: The object is not the one of the result"),
        (("small.json", "--object", "ball.stl", "--unit", "cm"), "planned with unit 'mm', not 'cm'"),
        (("one_grasp.npy", "--object", "crate.ply"), "no known format"),
        (("no.json", "--object", "ball.stl"), "no.json is not JSON"),
        (("one.json", "--object", "ball.stl"), "one.json: This is not a result of Fingersplit"),
        (("small.json", "--object", "ball.stl", "--protocol", "drop"), "Unknown verification protocol"),
    ):
        finished = run_program("verify", *arguments, cwd=folder)
        assert finished.returncode == 2
        assert finished.stdout == ""
        assert finished.stderr.startswith("Error: ")
        assert sentence in finished.stderr


def test_formats_are_listed_from_the_registry(folder):
    listed = run_program("formats", cwd=folder)
    assert listed.returncode == 0
    for name, one in available_formats().items():
        row = next(line for line in listed.stdout.splitlines() if line.split()[:1] == [name])
        assert ("written" in row) == (one.write is not None)


def test_sources_are_listed_from_the_registry(folder):
    listed = run_program("sources", cwd=folder)
    assert listed.returncode == 0
    assert [line.split(":")[0] for line in listed.stdout.splitlines()] == list(available_sources())
