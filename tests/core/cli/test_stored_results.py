"""Every command on a stored result works from that result alone, whatever it was planned with; else it says why not."""

import json
import shutil
from itertools import pairwise
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
import trimesh
from rerun.chunk import RrdReader

from fingersplit.hands.files import find_hand
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from in_process import run_program

FRICTION = ("--friction", 0.4)
"""Options of `plan` by case: the file, and what was said of it."""
CASES = {
    "plain": ("box.ply",),
    "mass": ("box.ply", "--mass", 0.9),
    "density": ("box.ply", "--density", 2700),
    "friction": ("box.ply", *FRICTION),
    "fairing": ("box.ply", "--fairing", 0.02),
    "unit": ("box_mm.stl", "--unit", "mm"),
    "scale": ("box_mm.stl", "--scale", 0.001, "--mass", 0.4),
    "setting": ("box.ply", "--setting", "pad_angle_limit=0.45", "--setting", "friction=0.5"),
    "fidelity": ("box.ply", "--setting", "fidelity=paper"),
    "source": ("box.ply", "--source", "surface_fitting"),
    "simulation": ("box.ply", "--simulated-friction", 0.3, "--protocol", "gravity_six", "--controller", "joint_torque"),
    "pull": ("box.ply", "--mass", 0.4, "--protocol", "pull"),
    "frame": ("box.ply", "--protocol", "shake", "--controller", "virtual_frame"),
    "table": ("box.ply", "--table", "--protocol", "pick"),
    "cloud": ("cloud.npz", "--mass", 0.2),
    "viewpoint": ("seen.ply", "--unit", "cm", "--viewpoint", 60, 18, 24, "--friction", 0.7),
}


def well(*arguments: object, cwd: Path) -> CompletedProcess[str]:
    finished = run_program(*arguments, cwd=cwd)
    assert finished.returncode in {0, 1}, finished.stderr
    assert "Traceback" not in finished.stderr, finished.stderr
    return finished


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("stored")
    solid = PARAMETRIC_OBJECTS["box"]().trimesh
    solid.export(folder / "box.ply")
    large = solid.copy()
    large.apply_scale(1000)
    large.export(folder / "box_mm.stl")
    rng = np.random.default_rng(0)
    points, faces = trimesh.sample.sample_surface(solid, 6000, seed=1)
    normals = solid.face_normals[faces]
    noisy = points + 0.0003 * rng.normal(size=points.shape)
    np.savez(folder / "cloud.npz", points=noisy, normals=normals)
    seen = (normals @ (0.6, 0.18, 0.24)) > 0
    trimesh.PointCloud(100 * noisy[seen]).export(folder / "seen.ply")
    altered = solid.copy()
    altered.vertices[0] += (0, 0, 1e-3)
    altered.export(folder / "altered.ply")
    return folder


@pytest.fixture(scope="module")
def planned(folder):
    """Plans a case once, verified and with a recording; its file and its document."""
    documents = {}

    def make(case: str) -> tuple[str, dict]:
        if case not in documents:
            file, *options = CASES[case]
            asked = ("--starts", 12, "--seed", 3, "--top-k", 3, "--verified", 2, "--initial")
            written = ("--json", f"{case}.json", "--recording", f"{case}-planned.rrd")
            well("plan", file, *options, *asked, *written, cwd=folder)
            documents[case] = file, json.loads((folder / f"{case}.json").read_text())
            assert documents[case][1]["grasps"], "nothing to look at"
        return documents[case]

    return make


def without_times(report):
    return {name: value for name, value in report.items() if name != "time_ms"}


@pytest.mark.parametrize("case", CASES)
def test_verify_gives_the_verdicts_of_plan_verified(folder, planned, case):
    file, document = planned(case)
    _, *options = CASES[case]
    said = {"--simulated-friction": "--friction", "--protocol": "--protocol", "--controller": "--controller"}
    simulation = [text for name, value in pairwise(options) if name in said for text in (said[name], value)]
    reports = f"{case}-again.json"
    initial = () if case == "table" else ("--initial",)
    well("verify", f"{case}.json", "--object", file, *simulation, *initial, "--json", reports, cwd=folder)
    again = json.loads((folder / reports).read_text())["grasps"]
    tried = [grasp for grasp in document["grasps"] if grasp["verification"] is not None]
    assert tried
    for grasp, row in zip(tried, again, strict=False):
        assert row["name"] == f"rank {grasp['rank']}"
        assert without_times(row["verification"]) == without_times(grasp["verification"])
        if case != "table":  # no way leads to an initial grasp
            assert without_times(row["initial_verification"]) == without_times(grasp["initial"]["verification"])


def log_of(path):
    """What the log of a recording says."""
    chunks = [chunk for chunk in RrdReader(path).stream().to_chunks() if str(chunk.entity_path) == "/log"]
    batch = chunks[0].to_record_batch()
    (name,) = [name for name in batch.schema.names if name.endswith(":text")]
    return [text for row in batch.column(name).to_pylist() for text in row]


@pytest.mark.parametrize("case", CASES)
def test_record_shows_what_plan_recorded(folder, planned, case):
    file, document = planned(case)
    finished = well("record", f"{case}.json", "--object", file, "-o", f"{case}.rrd", cwd=folder)
    assert finished.stdout.startswith(f"Wrote {case}.rrd: ")
    log = log_of(folder / f"{case}.rrd")
    assert log == log_of(folder / f"{case}-planned.rrd")
    verdict = document["grasps"][0]["verification"]["explanation"]
    assert any(verdict in line for line in log[-2:])  # the initial grasp comes last where it was simulated, too


@pytest.mark.parametrize("case", ["setting", "viewpoint"])
def test_export_needs_the_result_only(folder, planned, case):
    _, document = planned(case)
    rank = document["grasps"][-1]["rank"]
    arguments = (f"{case}.json", "--format", "moveit", "--rank", rank, "-o", f"{case}-moveit.json")
    well("export", *arguments, cwd=folder)
    said = json.loads((folder / f"{case}-moveit.json").read_text())["fingersplit"]
    assert said["object_id"] == document["object"]["id"]
    assert said["hand_description_sha256"] == document["provenance"]["hand_sha256"]


def test_tables_state_slip_and_turn(folder, planned):
    file, document = planned("mass")
    reports = [grasp["verification"] for grasp in document["grasps"] if grasp["verification"]]
    printed = well("verify", "mass.json", "--object", file, "--rank", 1, cwd=folder).stdout
    report = reports[0]
    assert "slip mm" in printed
    assert f"{1e3 * report['slip']:.1f}" in printed
    assert f"{np.degrees(report['turn']):.1f}" in printed
    assert ("firmly" in printed) == report["held_firmly"]


def test_the_options_are_in_the_document(planned):
    assert planned("mass")[1]["object"]["mass"] == pytest.approx(0.9)
    assert planned("mass")[1]["grasps"][0]["verification"]["settings"]["mass"] == pytest.approx(0.9)
    assert planned("friction")[1]["friction"] == 0.4
    assert planned("setting")[1]["friction"] == 0.5
    assert planned("setting")[1]["provenance"]["planner"]["pad_angle_limit"] == 0.45
    assert planned("fairing")[1]["object"]["options"]["fairing"] == 0.02
    source = planned("viewpoint")[1]["object"]["source"]
    assert (source["unit"], source["viewpoint"]) == ("cm", [60, 18, 24])
    assert planned("unit")[1]["object"]["extents"] == pytest.approx(planned("plain")[1]["object"]["extents"], abs=1e-6)


def changed(folder, planned, name, change):
    """The plain document with a change, as a file."""
    document = json.loads(json.dumps(planned("plain")[1]))
    change(document)
    (folder / name).write_text(json.dumps(document))
    return name


REFUSALS = {
    "altered mesh": ("altered.ply", lambda _: None, "altered.ply: The object is not the one of the result"),
    "altered option": (
        "box.ply",
        lambda document: document["object"]["options"].update(fairing=0.03),
        "The object is not the one of the result",
    ),
    "another unit": (
        "box.ply",
        lambda document: document["object"]["source"].update(unit="in"),
        "box.ply: The object is not the one of the result",
    ),
    "impossible unit": (
        "box.ply",
        lambda document: document["object"]["source"].update(unit="mm"),
        "box.ply, read as the result was planned (unit 'mm'), is not its object 'box'",
    ),
    "altered hand": (
        "box.ply",
        lambda document: document["provenance"].update(hand_sha256="f" * 64),
        "description of the hand 'barrett' was altered",
    ),
    "unknown hand": ("box.ply", lambda document: document.update(hand="octopus"), "Unknown hand 'octopus'"),
    "older schema": ("box.ply", lambda document: document.pop("schema_version"), "has no schema_version"),
    "newer schema": ("box.ply", lambda document: document.update(schema_version=9), "has schema_version 9"),
}


@pytest.mark.parametrize("command", ["verify", "record"])
@pytest.mark.parametrize("reason", REFUSALS)
def test_what_does_not_belong_together_is_refused(folder, planned, reason, command):
    file, change, said = REFUSALS[reason]
    name = changed(folder, planned, "changed.json", change)
    finished = run_program(command, name, "--object", file, cwd=folder)
    assert (finished.returncode, finished.stdout) == (2, "")
    assert finished.stderr.count("\n") == 1
    assert said in finished.stderr


@pytest.mark.parametrize("reason", ["altered hand", "unknown hand", "older schema", "newer schema"])
def test_an_export_needs_the_hand_and_the_schema_of_the_result(folder, planned, reason):
    _, change, said = REFUSALS[reason]
    name = changed(folder, planned, "changed.json", change)
    finished = run_program("export", name, "--format", "isaac_grasp", "-o", "grasps.yaml", cwd=folder)
    assert (finished.returncode, finished.stdout) == (2, "")
    assert said in finished.stderr


def test_a_result_for_a_hand_of_ones_own_is_exported_with_that_hand(folder):
    shutil.copytree(find_hand("barrett").root, folder / "hands" / "mine")
    well("plan", "box.ply", "--hand", "hands/mine", "--starts", 8, "--json", "mine.json", cwd=folder)
    asked = ("export", "mine.json", "--format", "isaac_grasp", "-o", "mine.yaml")
    finished = run_program(*asked, cwd=folder)
    assert (finished.returncode, "Unknown hand 'mine'" in finished.stderr) == (2, True)
    well(*asked, "--hand", "hands/mine", cwd=folder)
    assert "hand: mine" in (folder / "mine.yaml").read_text()


def test_unknown_settings_and_ranks_are_refused(folder, planned):
    name = changed(folder, planned, "haste.json", lambda document: document["provenance"]["planner"].update(haste=1))
    finished = run_program("record", name, "--object", "box.ply", cwd=folder)
    assert (finished.returncode, finished.stdout) == (2, "")
    assert "Unknown planner setting 'haste'" in finished.stderr
    for command in ("verify", "record"):
        finished = run_program(command, "plain.json", "--object", "box.ply", "--rank", 99, cwd=folder)
        assert finished.returncode == 2
        assert "99" in finished.stderr


def test_a_grasp_that_is_found_no_more_is_refused(folder, planned):
    def tighten(document):
        document["provenance"]["planner"]["cpo_trust_region"] = 0.01

    name = changed(folder, planned, "tight.json", tighten)
    finished = run_program("record", name, "--object", "box.ply", cwd=folder)
    assert finished.returncode == 2
    assert "rank 1 could not be reproduced" in finished.stderr


def test_a_recording_without_a_display_points_to_the_browser(folder, planned, monkeypatch):
    planned("plain")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    finished = run_program("review", "plain-planned.rrd", cwd=folder)
    assert finished.returncode == 2
    assert "/review" in finished.stderr


def test_a_grid_shows_every_protocol_over_a_set(folder):
    options = ("--protocol", "lift", "--protocol", "six_direction", "--starts", 8, "--json", "grid.json")
    finished = well("grid", "box.ply", "altered.ply", *options, cwd=folder)
    rows = json.loads((folder / "grid.json").read_text())["grasps"]
    assert [row["object"] for row in rows] == ["box", "altered"]
    assert all(set(row["verifications"]) == {"lift", "six_direction"} for row in rows)
    held = sum(row["verifications"]["lift"]["passed"] for row in rows)
    assert f"{held}/2" in finished.stdout
    refused = run_program("grid", "box.ply", "--protocol", "pick", cwd=folder)
    assert refused.returncode == 2
    assert "add --table" in refused.stderr
