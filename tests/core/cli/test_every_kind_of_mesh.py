"""One grasp is planned and verified on every kind of mesh that intake accepts."""

import json

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import field_cases as case
from fingersplit.cli.main import app

CUBE = trimesh.creation.box((40, 40, 40))
BALL = trimesh.creation.icosphere(subdivisions=3, radius=25)


def moved(mesh: trimesh.Trimesh, *offset: float) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices + offset, mesh.faces, process=False)


def walled() -> trimesh.Trimesh:
    """A box with a wall inside that shares its edges: three faces meet at each."""
    left, right = CUBE, moved(CUBE, 40, 0, 0)
    both = trimesh.util.concatenate(left, right)
    inner = np.abs(both.triangles_center[:, 0] - 20) < 1e-6
    keep = ~inner
    keep[np.flatnonzero(inner)[:2]] = True
    both.update_faces(keep)
    return both


def without_lid() -> trimesh.Trimesh:
    box = CUBE.copy()
    box.update_faces(box.face_normals[:, 2] < 0.5)
    return box


KINDS = {
    "polygons": case.prism(case.NOTCHED, 30),
    "sides_touch": case.joined(CUBE, moved(CUBE, 40, 0, 0)),
    "sides_touch_crossed": case.joined(CUBE, trimesh.Trimesh(moved(CUBE, 40, 0, 0).vertices[:, [0, 2, 1]], CUBE.faces)),
    "edges_touch": case.joined(CUBE, moved(CUBE, 40, 0, 40)),
    "corners_touch": case.joined(CUBE, moved(CUBE, 40, 40, 40)),
    "wall_inside": case.joined(walled()),
    "overlap": case.joined(BALL, moved(BALL, 20, 0, 0)),
    "part_inside": case.joined(BALL, trimesh.creation.icosphere(subdivisions=1, radius=8)),
    "apart": case.joined(CUBE, moved(CUBE, 60, 0, 0)),
    "doubled": case.joined(CUBE, trimesh.Trimesh(CUBE.vertices[:, [1, 0, 2]], CUBE.faces[:, ::-1])),
    "open": case.joined(without_lid()),
    "pinhole": case.pinholed_ell(True),
    "inside_out": case.joined(trimesh.Trimesh(BALL.vertices, BALL.faces[:, ::-1])),
    "thin": case.joined(trimesh.creation.box((85, 54, 0.76))),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_grasp_is_planned_and_verified(kind, tmp_path):
    mesh, result = tmp_path / f"{kind}.obj", tmp_path / "result.json"
    mesh.write_bytes(case.as_obj(KINDS[kind]))
    options = [
        "--unit",
        "mm",
        "--starts",
        "16",
        "--seed",
        "1",
        "--top-k",
        "3",
        "--verified",
        "1",
        "--json",
        str(result),
    ]
    run = CliRunner().invoke(app, ["plan", str(mesh), *options])
    assert run.exit_code == 0, (run.output, run.exception)
    document = json.loads(result.read_text())
    assert any(grasp["verification"] is not None for grasp in document["grasps"])
    assert document["object"]["mass"] > 0
    for remark in document["object"]["report"]["remarks"]:
        assert remark[:40] in run.output.replace("\n", " ")
