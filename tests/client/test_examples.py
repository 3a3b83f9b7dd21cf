"""The programs of `examples/` that a robot programmer would write, as they are, against the real service."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
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


@pytest.mark.campaign
def test_hand_over_files_are_written(service: str, tmp_path: Path) -> None:
    shown = run(service, "hand_over.py", MUG, tmp_path / "out")
    assert shown[0].startswith("<PlanResult barrett on mug")
    grasps = json.loads((tmp_path / "out" / "grasps.json").read_text())["grasps"]
    goals = json.loads((tmp_path / "out" / "curobo.json").read_text())
    assert len(grasps) == len(goals["grasp_poses"]["position"]) > 0
    assert all(grasp["pre_grasp_approach"]["desired_distance"] > 0 for grasp in grasps)


@pytest.mark.campaign
def test_an_arm_lifts_an_object_by_a_planned_grasp(service: str) -> None:
    shown = run(service, "arm.py", MUG)
    lifted, wanted, slipped = map(float, re.findall(r"(-?[\d.]+)(?: of| mm)", shown[-2]))
    assert lifted > 0.9 * wanted > 0
    assert slipped < 10
    assert shown[-1] == "The object was held."


def acronym(path: Path) -> None:
    """A Panda that comes down on a box and closes across its 5 cm, as ACRONYM writes it."""
    with h5py.File(path, "w") as file:
        pose = np.diag([1.0, -1.0, -1.0, 1.0])  # x closes, z comes down
        pose[2, 3] = 0.06 + 0.09
        file["grasps/transforms"] = np.array([pose, pose])
        file["grasps/qualities/flex/object_in_gripper"] = np.array([1, 0])
        file["gripper/type"] = "panda"
        file["object/scale"] = 1.0


def dexnet(path: Path) -> None:
    """The same as a Dex-Net database: centre, axis, widths."""
    with h5py.File(path, "w") as file:
        grasp = file.create_group("datasets/mini/objects/box/grasps/grasp_0")
        grasp.attrs["id"], grasp.attrs["type"], grasp.attrs["frame"] = 0, "ParallelJawPtGrasp3D", "object"
        grasp.attrs["configuration"] = [0, 0, 0.02, 1, 0, 0, 0.08, 0, 0.01, 0.0]


@pytest.mark.parametrize(("write", "said"), [(acronym, "ACRONYM"), (dexnet, "Dex-Net")])
def test_grasps_of_data_sets_are_starts(write, said, service: str, tmp_path: Path) -> None:
    PARAMETRIC_OBJECTS["box"]().trimesh.export(tmp_path / "box.ply")
    write(tmp_path / "grasps.h5")
    message, result = run(service, "other_starts.py", tmp_path / "box.ply", tmp_path / "grasps.h5")
    assert said in message
    assert result.startswith("<PlanResult barrett on box")


@pytest.mark.campaign
def test_a_depth_image_becomes_a_grasp(service: str, tmp_path: Path) -> None:
    """A camera that looks down on a ball of 7 cm on a table."""
    rows, columns = np.mgrid[:240, :320]
    focal, radius, distance = 400.0, 0.035, 0.5
    rays = np.dstack([(columns - 160) / focal, (rows - 120) / focal, np.ones((240, 320))])
    square, along = (rays**2).sum(axis=-1), rays[..., 2] * (distance - radius)
    root = along**2 - square * ((distance - radius) ** 2 - radius**2)
    inside = root > 0  # where a ray meets the ball
    depth = np.where(inside, (along - np.sqrt(np.maximum(root, 0))) / square, distance)
    np.savez(tmp_path / "view.npz", depth=depth, intrinsics=[focal, focal, 160, 120], mask=inside)
    shown = run(service, "depth_to_grasp.py", tmp_path / "view.npz")
    assert shown[0].startswith("<PlanResult barrett on")
