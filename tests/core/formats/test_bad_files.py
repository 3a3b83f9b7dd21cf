"""Files that hold no parallel grasps are refused with a sentence that says what is wrong."""

import json

import h5py
import numpy as np
import pytest
import yaml

from fingersplit.errors import FormatError
from fingersplit.formats import import_parallel_grasps

POSE = np.eye(4).tolist()


def refuse(path, model, name=None) -> str:
    with pytest.raises(FormatError) as caught:
        import_parallel_grasps(path, model, name)
    message = str(caught.value)
    assert message.endswith(".")
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{not json", "is not JSON"),
        ("3", "in no known format"),
        ("{}", "in no known format"),
        ("[]", "lists 0 grasps"),
        ('[{"contacts": [[0, 0, 0], [1, 0, 0]]}]', "missing: 'approach'"),
        ('[{"contacts": [[0, 0, 0], [0, 0, 0]], "approach": [0, 0, 1]}]', "coincide"),
        ('[{"contacts": [[0, 0, 0], [1, 0, 0]], "approach": [0, 0, 1]}, 7]', "no complete Fingersplit JSON"),
        ('[{"center": [0, 0, 0], "axis": [0, 0, 1]}]', "needs center, axis and open_width"),
        ('[{"center": [0, 0], "axis": [0, 0, 1], "open_width": 0.1}]', r"center has the shape (1, 2); it must be nx3"),
        ('[{"center": [0, 0, 0], "axis": [0, 0, 0], "open_width": 0.1}]', "axis with a length"),
        ('[{"center": [0, 0, 1e999], "axis": [0, 0, 1], "open_width": 0.1}]', "not finite"),
        ('{"grasps": {"transforms": [[1]]}}', "grasps.transforms has the shape"),
        (json.dumps({"grasps": {"transforms": (2 * np.eye(4)).reshape(1, 4, 4).tolist()}}), "no rigid transform"),
        (json.dumps({"grasps": {"transforms": [np.diag([1.0, 1, -1, 1]).tolist()]}}), "it mirrors"),
        (json.dumps({"grasps": {"transforms": [POSE]}, "gripper": "robotiq_2f_140"}), "gripper 'robotiq_2f_140'"),
        (json.dumps({"grasps": {"transforms": [POSE], "object_in_gripper": [1, 1]}}), "has the shape (2,)"),
        (
            json.dumps(
                {"grasps": {"transforms": [[*POSE[:2], [0, 0, 1, 5], POSE[3]]]}, "object": {"scale": 2.0}},
            ),
            "none of 1 grasps closes on the object, whose sides are 50, 70, 120 mm",
        ),
    ],
)
def test_json(prepared, tmp_path, text, sentence):
    (tmp_path / "grasps.json").write_text(text)
    assert sentence in refuse(tmp_path / "grasps.json", prepared("box"))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"format_version": 2.0}, "format_version 2.0"),
        ({"grasps": {}}, "lists no grasps"),
        ({"gripper_frame_link": "robotiq"}, "for the gripper 'robotiq', whose jaws are not known here"),
        ({"gripper_frame_link": None}, "does not name its gripper"),
        ({"grasps": {"g": {"position": [0, 0, 0]}}}, "g of the Isaac grasp file needs position"),
        (
            {"grasps": {"g": {"position": [0, 0], "orientation": {"w": 1, "xyz": [0, 0, 0]}}}},
            "position of g has the shape",
        ),
    ],
)
def test_isaac(prepared, tmp_path, change, sentence):
    grasp = {"position": [0, 0, 9.0], "orientation": {"w": 1.0, "xyz": [0, 0, 0]}, "cspace_position": {}}
    whole = {"format": "isaac_grasp", "format_version": 1.0, "gripper_frame_link": "panda_hand", "grasps": {"g": grasp}}
    (tmp_path / "g.yaml").write_text(yaml.safe_dump({**whole, **change}))
    assert sentence in refuse(tmp_path / "g.yaml", prepared("box"))
    (tmp_path / "broken.yaml").write_text("format: isaac_grasp\ngrasps: [")
    assert "is not YAML" in refuse(tmp_path / "broken.yaml", prepared("box"))


@pytest.mark.parametrize(
    ("array", "sentence"),
    [
        (np.zeros((2, 16)), "must be nx17"),
        (np.zeros((0, 17)), "lists 0 grasps"),
        (np.zeros((2, 17)), "a positive width"),
        (np.full((1, 17), np.nan), "not finite"),
        (np.eye(17)[:2] * 0 + np.r_[np.ones(16), 0][None] * [[1], [1]] + np.eye(17)[[16, 0]], "grasps of 2 objects"),
        (np.array([{"a": 1}]), "in no known format"),
    ],
)
def test_graspnet(prepared, tmp_path, array, sentence):
    np.save(tmp_path / "g.npy", array)
    assert sentence in refuse(tmp_path / "g.npy", prepared("box"))


def test_hdf5(prepared, tmp_path):
    model, path = prepared("box"), tmp_path / "g.h5"
    with h5py.File(path, "w") as file:
        file["something"] = 1
    assert "in no known format" in refuse(path, model)
    assert "no complete Dex-Net HDF5" in refuse(path, model, "dexnet")
    with h5py.File(path, "w") as file:
        file.create_group("grasps/transforms")
    assert "no dataset" in refuse(path, model)
    with h5py.File(path, "w") as file:
        grasp = file.create_group("datasets/set/objects/box/grasps/grasp_0")
        grasp.attrs["configuration"] = np.zeros(5)
    assert "must be 10 numbers, in old files 9" in refuse(path, model)
    with h5py.File(path, "w") as file:
        grasp = file.create_group("datasets/set/objects/box/grasps/grasp_0")
        grasp.attrs.update({"configuration": np.ones(10), "type": "VacuumPoint"})
    assert "type 'VacuumPoint'" in refuse(path, model)
    with h5py.File(path, "w") as file:
        file.create_group("datasets")
    assert "grasps of 0 objects" in refuse(path, model)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert "damaged HDF5" in refuse(path, model)


def test_format_must_be_known_and_fit_the_file(prepared, tmp_path):
    (tmp_path / "g.json").write_text("[]")
    unknown = refuse(tmp_path / "g.json", prepared("box"), "grasp")
    assert "Unknown format 'grasp'; did you mean 'graspnet'? Known: acronym, " in unknown
    assert "is a file of kind json; ACRONYM HDF5 needs hdf5" in refuse(tmp_path / "g.json", prepared("box"), "acronym")
    assert "cannot be read" in refuse(tmp_path / "nowhere.json", prepared("box"))
