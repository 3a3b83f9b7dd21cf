"""The programs of `examples/` that a robot programmer would write, as they are, against the real service."""

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fingersplit_client import Client

EXAMPLES = Path(__file__).parents[2] / "examples"
MUG = EXAMPLES / "objects" / "mug.ply"


def run(service: str, name: str, *arguments: object) -> list[str]:
    """Lines that an example prints."""
    command = [sys.executable, EXAMPLES / name, *map(str, arguments)]
    environment = os.environ | {"FINGERSPLIT_SERVER": service}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("name", ["mesh_to_moveit.py", "fleet.py", "folder.py"])
def test_they_have_ten_lines_at_most(name: str) -> None:
    module = ast.parse((EXAMPLES / name).read_text())
    for part in ast.walk(module):
        if isinstance(part, ast.Module | ast.AsyncFunctionDef) and ast.get_docstring(part):
            del part.body[0]
    lines = [line for line in ast.unparse(module).splitlines() if line.strip()]
    assert len(lines) <= 10


def test_a_mesh_becomes_a_moveit_grasp_in_the_robots_frame(service: str, tmp_path: Path) -> None:
    shown = run(service, "mesh_to_moveit.py", MUG, tmp_path / "grasp.json")
    (grasp,) = json.loads((tmp_path / "grasp.json").read_text())["grasps"]
    assert grasp["grasp_pose"]["header"]["frame_id"] == "base_link"
    assert "held in simulation> in base_link" in shown[0]
    assert abs(grasp["grasp_pose"]["pose"]["position"]["x"] - 0.5) < 0.3


def test_a_fleet_plans_and_gives_up(service: str) -> None:
    shown = run(service, "fleet.py", MUG, 600)
    assert len(shown) == 20
    assert all(line.startswith("<PlanResult barrett on mug") for line in shown)
    assert len(set(shown)) == 20
    assert run(service, "fleet.py", MUG, 0.02) == ["TimeoutError()"] * 20
    with Client(service) as client:
        assert list(client.jobs.all(state=["queued", "running"])) == []


def test_a_folder_is_planned_once(service: str, tmp_path: Path) -> None:
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    shutil.copy(MUG, meshes / "mug.ply")
    (meshes / "bad.ply").write_bytes(b"ply")
    first = sorted(run(service, "folder.py", meshes, tmp_path / "results"))
    again = sorted(run(service, "folder.py", meshes, tmp_path / "results"))
    assert first[0].startswith("bad.ply")
    assert "(HTTP 422)" in first[0]
    assert first[1].startswith("mug.ply  <PlanResult")
    assert again[1].startswith("mug.ply (there already) <PlanResult")
    assert len(list((tmp_path / "results").glob("mug-*.json"))) == 1
