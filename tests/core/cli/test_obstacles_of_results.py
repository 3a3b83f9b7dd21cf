"""Results whose scenes have meshes and clouds among the obstacles, from the document and the files."""

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from fingersplit.cli.main import app
from fingersplit.cli.objects import obstacle_files
from fingersplit.errors import SceneError

RUNNER = CliRunner()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A carton in metres, and as obstacles a wall and a cloud."""
    folder = tmp_path_factory.mktemp("scene")
    trimesh.creation.box((0.06, 0.05, 0.12)).export(folder / "carton.ply")
    trimesh.creation.box((0.02, 0.3, 0.2)).export(folder / "wall.ply")
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.03)
    np.savez(folder / "cloud.npz", points=ball.vertices, normals=ball.vertex_normals)
    scene = {
        "support_surfaces": [{}],
        "obstacles": [
            {"id": "wall", "object_id": "wall.ply", "pose": {"position": [0.2, 0.0, 0.1]}},
            {"id": "ball", "object_id": "cloud.npz", "pose": {"position": [-0.15, 0.1, 0.03]}},
        ],
    }
    (folder / "scene.json").write_text(json.dumps({"scene": scene}))
    plan = ["plan", str(folder / "carton.ply"), "--unit", "m", "--scene", str(folder / "scene.json"), "--starts", "16"]
    found = RUNNER.invoke(app, [*plan, "--top-k", "1", "--json", str(folder / "result.json")])
    assert found.exit_code == 0, found.output
    return folder


def test_a_stored_grasp_is_picked_among_its_obstacles(folder):
    files = ["--obstacle", str(folder / "wall.ply"), "--obstacle", str(folder / "cloud.npz")]
    verify = ["verify", str(folder / "result.json"), "--object", str(folder / "carton.ply"), "--protocol", "pick"]
    done = RUNNER.invoke(app, [*verify, *files, "--json", str(folder / "pick.json")])

    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    report = json.loads((folder / "pick.json").read_text())["grasps"][0]["verification"]
    assert report["protocol"] == "pick"
    assert set(report["settings"]["pick"]["first_touches"])

    without = RUNNER.invoke(app, [*verify, *files[:2]])
    assert isinstance(without.exception, SceneError)
    assert "--obstacle" in str(without.exception)


def test_a_stored_grasp_is_recorded_among_its_obstacles(folder):
    record = ["record", str(folder / "result.json"), "--object", str(folder / "carton.ply")]
    files = ["--obstacle", str(folder / "wall.ply"), "--obstacle", str(folder / "cloud.npz")]
    done = RUNNER.invoke(app, [*record, *files, "-o", str(folder / "grasp.rrd")])

    assert done.exit_code == 0, done.exception
    assert (folder / "grasp.rrd").stat().st_size > 10_000


def test_another_file_is_no_obstacle(folder):
    document = json.loads((folder / "result.json").read_text())
    ids = [one["object_id"] for one in document["provenance"]["constraints"]["scene"]["obstacles"]]
    find = obstacle_files([folder / "carton.ply", folder / "wall.ply"])
    assert find(ids[0]).id == ids[0]
    with pytest.raises(SceneError, match="none of the given files"):
        find(ids[1])
