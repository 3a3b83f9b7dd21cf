"""Shards: every grasp with all that is known of it, readable by anybody with h5py."""

import json

import h5py
import numpy as np
import pytest

from fingersplit.dataset.columns import COLUMNS
from fingersplit.dataset.reading import read_shard
from fingersplit.dataset.request import DatasetObject, DatasetRequest
from fingersplit.dataset.shards import PART, read_head, selection, shard_path, write_shard
from fingersplit.errors import DatasetError

ITEM = DatasetObject(7, "a box!", "a box!.ply", "0" * 64, "train")
ORDER = DatasetRequest(verified=True, per_object=2, licence="CC-BY-4.0")


@pytest.fixture
def shard(tmp_path, mixed, barrett):
    path = shard_path(tmp_path, ITEM, 2)
    path.parent.mkdir()
    write_shard(path, ITEM, ORDER, 2, selection(mixed, True, 2), mixed, barrett)
    return path


def test_a_shard_is_read_back_as_it_was_written(shard, mixed, barrett):
    assert shard.name == "00007-a-box-.0002.h5"
    read, grasps = read_shard(shard), mixed.grasps
    assert len(read) == len(grasps) > 3
    assert read.columns.keys() == {column.name for column in COLUMNS} | {"selected"}
    for row, grasp in enumerate(grasps):
        assert read.columns["palm_position"][row].tolist() == list(grasp.palm.position)
        assert dict(zip(read.hand["joint_names"], read.columns["joints"][row], strict=True)) == grasp.joints
        contacts = [list(contact.position) for contact in grasp.contacts]
        assert read.columns["contact_position"][row].tolist() == contacts
        assert np.isnan(read.columns["pregrasp_joints"][row]).all() == (grasp.pregrasp is None)
        np.testing.assert_allclose(read.object_from_palm[row], grasp.palm.object_from_palm, atol=1e-12)
        assert read.columns["metrics"][row][read.metric_names.index("isotropy")] == grasp.metrics["isotropy"]
    assert len(set(read.columns["id"])) == len(grasps)


def test_a_shard_says_what_its_grasps_depend_on(shard, mixed, barrett):
    read = read_shard(shard)
    said = read.attributes
    assert (said["licence"], said["split"], said["seed"], said["round"]) == ("CC-BY-4.0", "train", 3, 2)
    assert said["object_file_sha256"] == ITEM.sha256
    assert read.hand["description_sha256"] == barrett.sha256
    assert len(read.hand["contact_links"]) == 3
    assert read.object["id"] == mixed.object.id
    assert read.object["options"] == mixed.object.options.to_document()
    assert read.protocol["name"] == "lift"
    assert read.protocol["parameters"]["protocol"]["height"] == 0.2
    assert read.planner["settings"] == mixed.provenance.planner


def test_failures_stay_with_their_cause(shard, mixed):
    columns = read_shard(shard).columns
    causes = columns["cause"].tolist()
    assert causes[-1] == "infeasible: Finger finger1 lies 3 mm inside the object"
    for grasp, held, cause in zip(mixed.grasps[:-1], columns["held"], causes, strict=False):
        expected = (-1, "not verified")
        if grasp.verification is not None:
            expected = int(grasp.verification.passed), grasp.verification.reason
        assert (held, cause) == expected
    assert columns["selected"].sum() == 2
    assert (columns["held"][columns["selected"]] == 1).all()


def test_feasible_grasps_count_where_none_is_verified(mixed):
    chosen = selection(mixed, False, 3)
    assert chosen.sum() == 3
    assert not chosen[-1]
    assert selection(mixed, False, 1000).sum() == sum(grasp.feasible for grasp in mixed.grasps)


def test_every_array_says_its_unit_and_meaning(shard):
    with h5py.File(shard) as file:
        for name, rows in file["grasps"].items():
            assert rows.attrs["meaning"], name
        assert file["grasps/joints"].attrs["unit"] == "rad"
        assert json.loads(file.attrs["terminations"])


def test_a_head_counts(shard, mixed):
    head = read_head(shard)
    assert (head.index, head.round, head.rows, head.selected) == (7, 2, len(mixed.grasps), 2)
    assert head.verified >= head.held >= 2
    assert head.feasible == sum(grasp.feasible for grasp in mixed.grasps)
    assert not list(shard.parent.glob(f"*{PART}"))


@pytest.mark.parametrize("damage", [lambda data: data[: len(data) // 2], lambda data: b"not HDF5"])
def test_a_damaged_shard_is_named(shard, damage):
    shard.write_bytes(damage(shard.read_bytes()))
    for read in (read_head, read_shard):
        with pytest.raises(DatasetError, match="damaged"):
            read(shard)
