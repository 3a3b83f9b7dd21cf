"""Scenes for browsers: what a page decodes and moves is what was planned; sizes stay small."""

import base64
import gzip
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingersplit.hands.forward import link_poses
from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.planning.search import find_grasps
from fingersplit.recording.looks import hand_looks, light_mesh
from fingersplit.recording.replay import replay
from fingersplit.recording.three_assets import THREE_FILE, set_up_three
from fingersplit.recording.web_scene import grasp_scene, hand_scene, motion_scene, starts_scene
from fingersplit.scene import Constraints

MAX_BYTES = 500_000
TABLE = Constraints.from_document(
    {
        "scene": {
            "support_surfaces": [{"id": "table"}],
            "obstacles": [
                {
                    "id": "crate",
                    "primitive": {"type": "box", "dimensions": [0.1, 0.1, 0.1]},
                    "pose": {"position": [0.4, 0, 0.05]},
                }
            ],
        }
    }
)


@pytest.fixture(scope="module")
def model():
    return prepare_object(cylinder(0.03, 0.12), "can")


@pytest.fixture(scope="module")
def scene(model, barrett):
    planned = plan(model, barrett, starts=8, seed=1, constraints=TABLE)
    return planned, grasp_scene(replay(planned, 1, model, barrett), model, barrett)


def decoded(mesh):
    steps = np.frombuffer(base64.b64decode(mesh["points"]), np.uint16).reshape(-1, 3)
    faces = np.frombuffer(base64.b64decode(mesh["faces"]), np.uint32 if mesh["wide"] else np.uint16).reshape(-1, 3)
    return np.array(mesh["low"]) + steps * mesh["span"] / 0xFFFF, faces


def matrix(pose):
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = Rotation.from_quat(pose[3:], scalar_first=True).as_matrix(), pose[:3]
    return found


def moved(hand, palm, joints):
    """Links as the page moves them."""
    poses = []
    for link in hand["links"]:
        pose = (palm if link["parent"] < 0 else poses[link["parent"]]) @ matrix(link["pose"])
        for j in link["joints"]:
            joint, anchor, turn = hand["joints"][j], np.eye(4), np.eye(4)
            anchor[:3, 3] = joint["anchor"]
            turn[:3, :3] = Rotation.from_rotvec((joints[j] - joint["reference"]) * np.array(joint["axis"])).as_matrix()
            pose = pose @ anchor @ turn @ np.linalg.inv(anchor)
        poses.append(pose)
    return np.array(poses)


def test_the_page_moves_links_where_the_model_has_them(scene, barrett):
    planned, document = scene
    states, grasp = document["states"], planned.grasps[0].for_hand(barrett)
    poses = moved(document["hand"], matrix(states["palm"][-1]), states["joints"][-1])
    expected = grasp.object_from_palm @ link_poses(barrett.model, grasp.joints)
    assert np.abs(poses - expected).max() < 1e-4
    assert (
        np.abs(np.array(states["contacts"][-1]) - grasp.contacts).max() < 3e-4
    )  # the final ones are measured on triangles


def test_meshes_survive_their_packing(scene, model, barrett):
    vertices, faces = decoded(scene[1]["object"])
    assert np.abs(vertices.max(axis=0) - model.mesh.vertices.max(axis=0)).max() < 1e-5
    assert faces.max() < len(vertices)
    for mesh, look in zip(scene[1]["hand"]["meshes"], hand_looks(barrett), strict=True):
        points, corners = decoded(mesh)
        assert len(corners) == len(look.faces)
        assert np.abs(points.min(axis=0) - look.vertices.min(axis=0)).max() < 1e-5


def test_surroundings_stand_in_the_object_frame(scene):
    table, crate = scene[1]["around"]
    assert (table["name"], table["plane"], crate["size"]) == ("table", None, [0.05, 0.05, 0.05])
    up = np.array(scene[1]["up"])
    assert np.allclose(matrix(table["pose"])[:3, 2], up, atol=1e-4)
    apart = (matrix(crate["pose"]) - matrix(table["pose"]))[:3, 3] @ up
    assert apart == pytest.approx(0.05, abs=1e-4)


def test_contacts_on_an_assumed_surface_are_marked(scene, model, barrett):
    planned, document = scene
    assert document["assumed"] == [False, False, False]
    replayed = replay(planned, 1, model, barrett)
    first, *others = replayed.grasp.contacts
    guessed = replace(replayed.grasp, contacts=(replace(first, assumed=True), *others))
    assert grasp_scene(replace(replayed, grasp=guessed), model, barrett)["assumed"] == [True, False, False]


def test_a_scene_is_small(scene, barrett):
    for document in (scene[1], hand_scene(barrett)):
        assert len(gzip.compress(json.dumps(document).encode())) < MAX_BYTES


def test_every_start_says_where_it_ended(model, barrett):
    found = find_grasps(model, barrett, starts=8, seed=1)
    starts = starts_scene(found)["starts"]
    assert [one["feasible"] for one in starts] == [run.feasible for run in found.runs]
    assert all(one["violations"] or one["feasible"] for one in starts)


def test_without_a_simulation_there_is_no_motion():
    assert motion_scene(None) == {"times": []}


def test_preshapes_are_reached_by_drivers():
    document = hand_scene(load_hand("barrett_coupled"))
    coupling = document["coupling"]
    for posture in document["postures"]:
        joints = np.array(coupling["matrix"]) @ posture["drivers"] + coupling["offset"]
        assert np.abs(joints - posture["joints"]).max() < 1e-3


def test_heavy_meshes_get_lighter_and_keep_their_shape():
    mesh = cylinder(0.03, 0.12)
    finer = mesh.trimesh.subdivide()
    vertices, faces = finer.vertices, finer.faces
    fewer, triangles = light_mesh(np.array(vertices), np.array(faces), len(faces) // 4)
    assert len(triangles) < len(faces) // 3
    assert np.abs(np.ptp(fewer, axis=0) - np.ptp(vertices, axis=0)).max() < 2e-3


def test_three_js_is_taken_out_of_its_package(tmp_path, monkeypatch):
    monkeypatch.setenv("FINGERSPLIT_VIEWER_DIR", str(tmp_path))
    packed = (set_up_three() / f"{THREE_FILE}.gz").read_bytes()
    script = gzip.decompress(packed)
    assert script.startswith(b"/**\n * @license")
    assert all(
        name in script for name in (b"WebGLRenderer", b"BufferGeometry", b"MeshPhongMaterial", b"CapsuleGeometry")
    )
    assert len(packed) < 300_000
