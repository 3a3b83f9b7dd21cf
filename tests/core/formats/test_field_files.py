"""Grasp files as other programs really write them: dialects, scales, grippers without a name, true reasons."""

import json

import numpy as np
import pytest
import yaml

from fingersplit.errors import FormatError, SettingsError
from fingersplit.formats import import_parallel_grasps
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.objects.source import ObjectSource

DEPTH = 0.103  # from the Panda's hand frame to the middle of its pads
ABOVE = {"position": [0.0, 0.0, DEPTH], "orientation": {"w": 0.0, "xyz": [1.0, 0.0, 0.0]}}
"""A Panda above the 50 x 70 x 120 mm box whose pads stand in its middle and close along y."""
DOWN = [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, DEPTH], [0, 0, 0, 1]]
"""The same for formats that close along x."""


def isaac(tmp_path, comment="", grasp=None, **fields):
    document = {
        "format": "isaac_grasp",
        "format_version": 1.0,
        "object_frame_link": "/World/box",
        "gripper_frame_link": "/World/panda_hand",
        "grasps": {"grasp_0": ABOVE | {"confidence": 0.9} | (grasp or {})},
    } | fields
    path = tmp_path / "grasps.yaml"
    path.write_text(comment + yaml.safe_dump({k: v for k, v in document.items() if v is not None}, sort_keys=False))
    return path


def graspgen(tmp_path, scale=1.0, held=True, gripper="franka_panda"):
    document = {"object": {"scale": scale}, "grasps": {"transforms": [DOWN], "object_in_gripper": [held]}}
    path = tmp_path / "grasps.json"
    path.write_text(json.dumps(document | ({"gripper": {"name": gripper}} if gripper else {})))
    return path


def width(imported) -> float:
    (contacts,) = imported.grasps.contacts
    return float(np.linalg.norm(contacts[0] - contacts[1]))


@pytest.mark.parametrize(
    "dialect",
    [
        {},
        {"format_version": "1.0"},
        {"format_version": 1},
        {"format_version": None},
        {"format_version": "v1.0.2"},
        {"grasp": {"confidence": None}},
        {"object_scale": [1.0, 1.0, 1.0]},
        {
            "object_frame_link": None,
            "gripper_frame_link": None,
            "object_frame": "/World/box",
            "gripper_frame": "fr3_hand",
        },
        {"comment": "# " + "x" * 1100 + "\n"},
        {"comment": "# made by hand\n\n---\n"},
        {"grasp": {"cspace_position": {"panda_finger_joint1": 0.02}}},
        {"grasp": {"pregrasp_cspace_position": {"panda_finger_joint1": 0.04}}, "format_version": "1.0"},
        {"gripper_frame_link": None, "gripper_file": "bots/franka_panda.usd", "object_scale": 1.0},
    ],
)
def test_dialects_of_isaac_grasp_files(prepared, tmp_path, dialect):
    imported = import_parallel_grasps(isaac(tmp_path, **dialect), prepared("box"))
    assert (imported.format, imported.listed) == ("isaac_grasp", 1)
    assert width(imported) == pytest.approx(0.07)


def test_a_gripper_that_the_file_does_not_name_can_be_named(prepared, tmp_path):
    nameless = isaac(tmp_path, gripper_frame_link=None)
    with pytest.raises(FormatError, match="does not name its gripper"):
        import_parallel_grasps(nameless, prepared("box"))
    assert width(import_parallel_grasps(nameless, prepared("box"), gripper="panda")) == pytest.approx(0.07)
    other = isaac(tmp_path, gripper_frame_link="/World/tool0")
    with pytest.raises(FormatError, match="the gripper 'tool0', whose jaws are not known here; known: panda"):
        import_parallel_grasps(other, prepared("box"))
    assert width(import_parallel_grasps(other, prepared("box"), gripper="panda")) == pytest.approx(0.07)
    with pytest.raises(FormatError, match="Unknown gripper 'claw'; known: panda"):
        import_parallel_grasps(other, prepared("box"), gripper="claw")


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_a_scale_can_be_given_for_the_mesh_and_the_message_says_which(prepared, tmp_path, scale):
    path, mesh = graspgen(tmp_path, scale), prepared("box").mesh
    unscaled = prepare_object(Mesh(mesh.vertices / scale + 1.0, mesh.faces), "box")
    with pytest.raises(FormatError, match=rf"none of 1 grasps closes .* give the mesh a scale of {scale}"):
        import_parallel_grasps(path, unscaled)
    assert width(import_parallel_grasps(path, prepared("box"))) == pytest.approx(0.05)


@pytest.mark.parametrize("factor", [1e-3, 0.5, 2.0])
def test_lengths_of_a_file_can_be_scaled(prepared, tmp_path, factor):
    """The gripper stays as large as it is; where its frame stands is the file's length."""
    far = [[*row[:3], row[3] / factor] for row in DOWN]
    (tmp_path / "g.json").write_text(json.dumps({"grasps": {"transforms": [far]}}))
    assert width(import_parallel_grasps(tmp_path / "g.json", prepared("box"), scale=factor)) == pytest.approx(0.05)
    own = [{"contacts": [[0.025 / factor, 0, 0], [-0.025 / factor, 0, 0]], "approach": [0, 0, -1]}]
    (tmp_path / "own.json").write_text(json.dumps(own))
    assert width(import_parallel_grasps(tmp_path / "own.json", prepared("box"), scale=factor)) == pytest.approx(0.05)
    service = [{"center": [0, 0, 0], "axis": [1, 0, 0], "open_width": 0.06 / factor}]
    (tmp_path / "service.json").write_text(json.dumps(service))
    found = import_parallel_grasps(tmp_path / "service.json", prepared("box"), scale=factor)
    assert found.listed == 4
    assert np.ptp(found.grasps.contacts[:, :, 0], axis=1) == pytest.approx(0.05)


def test_json_and_yaml_hold_the_same_documents(prepared, tmp_path):
    as_json = tmp_path / "isaac.json"
    as_json.write_text(json.dumps(yaml.safe_load(isaac(tmp_path).read_text())))
    as_yaml = graspgen(tmp_path).rename(tmp_path / "graspgen.yaml")
    found = [import_parallel_grasps(path, prepared("box")).format for path in (as_json, as_yaml)]
    assert found == ["isaac_grasp", "graspgen"]


def test_grasps_in_millimetres_are_said_to_stand_far_away(prepared, tmp_path):
    far = [[*row[:3], row[3] * 1000] for row in DOWN]
    (tmp_path / "g.json").write_text(json.dumps({"grasps": {"transforms": [far]}}))
    with pytest.raises(FormatError, match=r"They stand 103 m from its middle: .* may need a scale"):
        import_parallel_grasps(tmp_path / "g.json", prepared("box"))


@pytest.mark.parametrize(
    ("name", "text", "place"),
    [
        ("cut.json", '{"grasps": [', "line 1 at column 13"),
        ("tabs.yaml", "format: isaac_grasp\ngrasps:\n\tg: 1\n", "line 3 at column 1"),
        ("two.yaml", "format: isaac_grasp\n---\nformat: isaac_grasp\n", "line 2 at column 1"),
        ("tag.yaml", "format: !!python/object:os.system {}\n", "line 1 asks for a type of a program"),
    ],
)
def test_broken_texts_are_told_by_place_and_in_no_words_of_a_library(prepared, tmp_path, name, text, place):
    (tmp_path / name).write_text(text)
    with pytest.raises(FormatError, match=place) as refused:
        import_parallel_grasps(tmp_path / name, prepared("box"))
    assert not any(word in str(refused.value) for word in ("token", "constructor", "Expecting", "delimiter", "None"))


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_what_is_no_scale_is_refused(prepared, tmp_path, scale):
    with pytest.raises(SettingsError, match="must be above 0"):
        import_parallel_grasps(graspgen(tmp_path), prepared("box"), scale=scale)


def test_failed_grasps_are_the_reason_when_all_are(prepared, tmp_path):
    with pytest.raises(FormatError, match="all 1 grasps of the file failed by its own account"):
        import_parallel_grasps(graspgen(tmp_path, held=False), prepared("box"))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("world.xml", '<?xml version="1.0"?>\n<world><graspableBody/></world>\n'),
        ("notes.txt", "no grasps at all"),
        ("nothing", ""),
        ("table.csv", "1,2,3\n4,5,6\n"),
    ],
)
def test_files_of_no_known_format_are_said_to_be(prepared, tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(FormatError, match="in no known format; known: ACRONYM HDF5, Dex-Net HDF5") as refused:
        import_parallel_grasps(tmp_path / name, prepared("box"))
    assert "JSON:" not in str(refused.value)


def test_byte_order_marks_are_skipped(prepared, tmp_path):
    for path in (graspgen(tmp_path), isaac(tmp_path)):
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
        assert len(import_parallel_grasps(path, prepared("box")).grasps) == 1


def test_a_mesh_that_has_the_files_scale_is_not_asked_for_it_again(tmp_path):
    far = np.eye(4) + np.array([[0, 0, 0, 1.0]] + [[0, 0, 0, 0]] * 3)
    file = tmp_path / "far.json"
    listed = {"transforms": [far.tolist()], "object_in_gripper": [True]}
    document = {"object": {"scale": 0.25}, "gripper": {"name": "franka_panda"}, "grasps": listed}
    file.write_text(json.dumps(document))
    model = prepare_object(box((0.04, 0.03, 0.02)), source=ObjectSource("m", 0.25))
    with pytest.raises(FormatError, match=r"object scale: 0.25, which it was given\."):
        import_parallel_grasps(file, model)
