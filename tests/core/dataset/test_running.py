"""Filling: nothing lost and nothing repeated, however often it is killed; failures noted; readable all the time."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import pytest

from fingersplit.dataset import Dataset, DatasetRequest, find_objects, make_dataset
from fingersplit.dataset.folder import DatasetFolder
from fingersplit.dataset.planners import LocalPlanner
from fingersplit.dataset.request import SPLITS
from fingersplit.errors import DatasetError
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.result import write_result

PROGRAM = Path(__file__).with_name("program.py")
KILLS = 5


def begin(folder, stored, objects):
    command = [sys.executable, PROGRAM, folder, stored, *objects]
    return subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, start_new_session=True)


def finish(process):
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors.decode()


def shards(folder):
    return sorted(folder.glob("*/*.h5"))


def contents(folder):
    """Everything that every shard holds, by its name."""
    found = {}
    for path in shards(folder):
        with h5py.File(path) as file:
            arrays = {
                name: rows[()].tobytes() if rows.dtype.kind != "O" else rows.asstr()[()].tolist()
                for name, rows in file["grasps"].items()
            }
            found[path.relative_to(folder)] = arrays
    return found


@pytest.fixture(scope="module")
def stored(verified_box, tmp_path_factory):
    path = tmp_path_factory.mktemp("stored") / "result.json"
    write_result(verified_box, path)
    return path


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    folder = tmp_path_factory.mktemp("objects")
    for number in range(5):
        (folder / f"thing{number}.ply").write_bytes(b"ply %d" % number)
    (folder / "bad.ply").write_bytes(b"no mesh")
    return [folder]


def test_killed_five_times_nothing_is_lost_or_repeated(tmp_path, stored, objects):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    finish(begin(whole, stored, objects))
    expected = contents(whole)
    per_kill = max(1, len(expected) // (KILLS + 2))
    for _ in range(KILLS):
        before = len(shards(killed))
        process = begin(killed, stored, objects)
        end = time.monotonic() + 120
        while len(shards(killed)) < before + per_kill and process.poll() is None:
            assert time.monotonic() < end
            time.sleep(0.002)
        for path in shards(killed):  # what is there can be read, though it is being filled
            with h5py.File(path) as file:
                assert len(file["grasps/id"]) == file.attrs["rows"]
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        kept = contents(killed)
        assert kept.items() <= expected.items()
    finish(begin(killed, stored, objects))
    assert contents(killed) == expected
    ids = [name for shard in expected.values() for name in shard["id"]]
    assert len(ids) == len(set(ids)) >= 5 * 24
    assert not list(killed.glob("*/*.part"))
    assert [one["code"] for one in DatasetFolder(killed).failures().values()] == ["invalid_mesh"]


def test_small_objects_are_planned_in_processes(tmp_path):
    files = tmp_path / "objects"
    files.mkdir()
    for name in ("box", "cylinder"):
        PARAMETRIC_OBJECTS[name]().trimesh.export(files / f"{name}.ply")
    (files / "bad.ply").write_bytes(b"ply")
    order = DatasetRequest(per_object=5, starts=6, max_rounds=4, mass=0.2, seed=1)
    items, paths, _ = find_objects([files], order.split)
    seen = []
    last = make_dataset(tmp_path / "set", order, items, paths, LocalPlanner(2), progress=seen.append)
    assert (last.objects, last.selected, last.failed, last.done) == (3, 10, 1, 3)
    assert seen[-1] == last
    assert "10 of 15 grasps of 3 objects, 1 objects short" in last.message
    dataset = Dataset(tmp_path / "set")
    for shard in dataset.shards():
        assert shard.attributes["seed"] == 1 + shard.attributes["round"]
        assert shard.object["mass"] == 0.2
    again = make_dataset(tmp_path / "set", order, items, paths, LocalPlanner(1))
    assert (again.selected, again.grasps) == (10, 0)


def test_an_object_is_given_up_when_rounds_find_nothing(tmp_path, verified_box, stored):
    from dataclasses import replace

    from fingersplit.dataset.filling import BARREN, fill_object
    from fingersplit.hands import load_hand

    nothing = replace(verified_box, grasps=())
    (tmp_path / "a.ply").write_bytes(b"a")
    order = DatasetRequest(per_object=5)
    items, _, _ = find_objects([tmp_path / "a.ply"], order.split)
    folder = DatasetFolder(tmp_path / "set")
    with folder.begun(order, items):
        fill_object(folder.path, order, items[0], lambda: (load_hand("barrett"), lambda _round, _missing: nothing))
    failure = folder.failures()[0]
    assert failure["code"] == "too_few_grasps"
    assert failure["message"].startswith(f"0 of 5 grasps after {BARREN} rounds.")
    assert len(shards(folder.path)) == BARREN


def test_another_order_or_a_second_writer_is_refused(tmp_path):
    (tmp_path / "a.ply").write_bytes(b"a")
    order = DatasetRequest(per_object=5)
    items, _, _ = find_objects([tmp_path / "a.ply"], order.split)
    folder = DatasetFolder(tmp_path / "set")
    second = pytest.raises(DatasetError, match="Another program is writing")
    with folder.begun(order, items), second, folder.begun(order, items):
        pass
    with (
        pytest.raises(DatasetError, match="was begun with per_object = 5, not 6"),
        folder.begun(DatasetRequest(per_object=6), items),
    ):
        pass
    with (
        pytest.raises(DatasetError, match="is not empty and holds no data set"),
        DatasetFolder(tmp_path).begun(order, items),
    ):
        pass


def test_splits_are_drawn_by_object(tmp_path):
    for number in range(20):
        (tmp_path / f"{number:02d}.ply").write_bytes(b"%d" % number)
    (tmp_path / "copy.ply").write_bytes(b"3")
    items, files, remarks = find_objects([tmp_path], (0.5, 0.25, 0.25))
    assert [sum(item.split == split for item in items) for split in SPLITS] == [10, 5, 5]
    assert len(files) == 20
    assert remarks == [f"{tmp_path / 'copy.ply'} is left out: it is the same file as {tmp_path / '03.ply'}."]
    renamed = tmp_path / "renamed"
    renamed.mkdir()
    for path in files:
        (renamed / f"x{path.name}").write_bytes(path.read_bytes())
    again, _, _ = find_objects([renamed], (0.5, 0.25, 0.25))
    assert {item.sha256: item.split for item in again} == {item.sha256: item.split for item in items}


@pytest.mark.campaign
def test_the_program_is_killed_five_times(tmp_path):
    """The real thing: processes that plan and verify small objects."""
    files = tmp_path / "objects"
    files.mkdir()
    for name in ("box", "cylinder", "capsule"):
        PARAMETRIC_OBJECTS[name]().trimesh.export(files / f"{name}.ply")
    arguments = ["--per-object", "16", "--verified", "--starts", "6", "--mass", "0.2"]

    def begin_command(folder):
        command = [sys.executable, "-c", "from fingersplit.cli.main import main; main()", "dataset", files]
        return subprocess.Popen(
            [*map(str, command), "-o", str(folder), *arguments], stderr=subprocess.PIPE, start_new_session=True
        )

    finish(begin_command(tmp_path / "whole"))
    expected = contents(tmp_path / "whole")
    killed = tmp_path / "killed"
    for _ in range(KILLS):
        before = len(shards(killed))
        process = begin_command(killed)
        end = time.monotonic() + 300
        while len(shards(killed)) <= before and process.poll() is None:
            assert time.monotonic() < end
            time.sleep(0.01)
        os.kill(process.pid, signal.SIGKILL)  # its workers end by themselves
        process.communicate()
    finish(begin_command(killed))
    assert contents(killed).keys() == expected.keys()
    assert [one["id"] for one in contents(killed).values()] == [one["id"] for one in expected.values()]
    assert json.loads((killed / "dataset.json").read_text())["order"]["per_object"] == 16
