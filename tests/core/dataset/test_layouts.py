"""Layouts of others, read back by the rules of their own readers."""

import json

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fingersplit.dataset import Dataset, DatasetRequest, find_objects
from fingersplit.dataset.converting import convert
from fingersplit.dataset.folder import DatasetFolder
from fingersplit.dataset.layouts import available_layouts
from fingersplit.dataset.shards import selection, shard_path, write_shard
from fingersplit.dataset.summary import write_summary
from fingersplit.errors import FormatError, OutputError
from fingersplit.formats.acronym import ACRONYM as READER


@pytest.fixture(scope="module")
def dataset(tmp_path_factory, mixed, barrett):
    """One object in millimetres, two rounds of the same grasps."""
    folder = tmp_path_factory.mktemp("layouts")
    (folder / "box.ply").write_bytes(b"box")
    order = DatasetRequest(verified=True, per_object=4, unit="mm", licence="CC0-1.0")
    items, _, _ = find_objects([folder / "box.ply"], order.split)
    kept = DatasetFolder(folder / "set")
    with kept.begun(order, items):
        for number in range(2):
            path = shard_path(kept.path, items[0], number)
            write_shard(path, items[0], order, number, selection(mixed, True, 2), mixed, barrett)
        kept.fail(items[0], "too_few_grasps", "An example.")
    return Dataset(kept.path)


@pytest.fixture(scope="module")
def joined(dataset):
    return dataset.joined(dataset.objects[0])


@pytest.fixture(scope="module")
def chosen(joined):
    """Places of the four grasps that count."""
    places = np.flatnonzero(joined.columns["selected"])
    assert len(places) == 4
    return places


@pytest.fixture
def converted(dataset, tmp_path):
    def one(layout):
        told = convert(dataset, layout, tmp_path / layout)
        assert (tmp_path / layout / f"{dataset.objects[0].split}.txt").read_text() == "00000-box\n"
        assert "of 1 objects" in told
        return tmp_path / layout

    return one


def test_dexgraspnet_turns_about_fixed_axes(converted, joined, chosen):
    """Its own reader: transforms3d's euler2mat of the three angles, 'sxyz', and joints by name."""
    rows = np.load(converted("dexgraspnet") / "dataset" / "00000-box.npy", allow_pickle=True)
    assert len(rows) == 4
    for row, place in zip(rows, chosen, strict=True):
        angles = [row["qpos"][name] for name in ("WRJRx", "WRJRy", "WRJRz")]
        pose = joined.object_from_palm[place]
        np.testing.assert_allclose(Rotation.from_euler("xyz", angles).as_matrix(), pose[:3, :3], atol=1e-9)
        assert [row["qpos"][name] for name in ("WRJTx", "WRJTy", "WRJTz")] == pose[:3, 3].tolist()
        joints = [row["qpos"][name] for name in joined.hand["joint_names"]]
        assert joints == joined.columns["joints"][place].tolist()
        assert row["scale"] == 1.0


def test_bodex_is_what_dexgraspbench_converts(converted, joined, chosen):
    """Its conversion: robot_pose[0] is (n, 3, 7 + J); the second is the grasp, the first the pre-grasp."""
    (path,) = converted("bodex").glob("**/*_grasp.npy")
    raw = np.load(path, allow_pickle=True).item()
    robot_pose = raw["robot_pose"][0]
    assert robot_pose.shape == (4, 3, 7 + len(joined.hand["joint_names"]))
    np.testing.assert_array_equal(robot_pose[:, 1, :3], joined.columns["palm_position"][chosen])
    np.testing.assert_array_equal(robot_pose[:, 0, 7:], joined.columns["pregrasp_joints"][chosen])
    np.testing.assert_array_equal(robot_pose[:, 2, 7:], joined.columns["squeeze_joints"][chosen])
    assert raw["obj_scale"][0] == 1.0
    assert raw["obj_pose"][0].shape == (7,)


def test_dexonomy_has_a_file_a_grasp(converted, joined, chosen):
    files = sorted(converted("dexonomy").glob("00000-box/*.npy"))
    assert len(files) == 4
    for path, place in zip(files, chosen, strict=True):
        sample = np.load(path, allow_pickle=True).item()
        np.testing.assert_array_equal(sample["grasp_qpos"][0, 3:7], joined.columns["palm_wxyz"][place])
        assert sample["pregrasp_qpos"].shape == sample["squeeze_qpos"].shape == sample["grasp_qpos"].shape
        (thing,) = sample["scene_cfg"]["scene"].values()
        assert thing["type"] == "rigid_object"
        assert sample["obj_cpn_w"].shape == (3, 6)


def test_multi_gripper_grasp_lists_poses_and_dofs(converted, joined, chosen):
    document = json.loads((converted("multi_gripper_grasp") / "barrett" / "barrett-00000-box.json").read_text())
    assert (document["gripper"], document["object_ID"]) == ("barrett", "00000-box")
    assert len(document["pose"]) == len(document["dofs"]) == 4
    assert document["pose"][0][3:] == joined.columns["palm_wxyz"][chosen[0]].tolist()
    assert document["fingersplit"]["licence"] == "CC0-1.0"


def judged(joined):
    return [place for place in range(len(joined)) if joined.columns["cause"][place] != "not verified"]


def test_graspgen_marks_failures_and_approaches_along_z(converted, joined):
    document = json.loads((converted("graspgen") / "grasps" / "00000-box.json").read_text())
    held = document["grasps"]["object_in_gripper"]
    places = judged(joined)
    assert held == [int(joined.columns["held"][place] == 1) for place in places]
    assert set(held) == {0, 1}
    assert document["object"] == {"file": "box.ply", "scale": 1.0}
    for place, transform in zip(places, document["grasps"]["transforms"], strict=True):
        matrix = np.array(transform)
        way = joined.columns["palm_position"][place] - joined.columns["pregrasp_position"][place]
        if np.isfinite(way).all():
            assert matrix[:3, 2] @ way / np.linalg.norm(way) > 0.7


def test_acronym_is_read_by_its_rules(converted, joined):
    path = converted("acronym") / "grasps" / "00000-box.h5"
    with h5py.File(path, "r") as data:
        transforms = np.array(data["grasps/transforms"])
        success = np.array(data["grasps/qualities/flex/object_in_gripper"])
        assert data["object/file"][()].decode() == "box.ply"
        assert data["object/scale"][()] == 1.0
        assert data["object/mass"][()] == joined.object["mass"]
        assert READER.recognises(data)
    assert transforms.shape == (len(judged(joined)), 4, 4)
    assert success.sum() == 4


def test_the_layouts_are_known_and_folders_are_new(dataset, tmp_path):
    names = {"acronym", "bodex", "dexgraspnet", "dexonomy", "graspgen", "multi_gripper_grasp"}
    assert set(available_layouts()) == names
    with pytest.raises(FormatError, match="did you mean 'bodex'"):
        convert(dataset, "bodec", tmp_path / "x")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "a").touch()
    with pytest.raises(OutputError, match="not empty"):
        convert(dataset, "bodex", tmp_path / "full")


def test_the_summary_shows_counts_and_causes(dataset, joined):
    page = write_summary(dataset.path).read_text()
    assert "CC0-1.0" in page
    assert "infeasible" in page
    assert "data:image/png;base64," in page
    assert "An example." in page
    counts = f"<td>box</td><td>{dataset.objects[0].split}</td><td class=n>4</td>"
    assert counts in page
    assert "http" not in page.replace("<!doctype html>", "")
