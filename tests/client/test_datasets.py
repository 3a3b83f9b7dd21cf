"""Data sets over HTTP: asked for, followed, downloaded into a folder that is read like one made on one machine."""

import tempfile
import time
from pathlib import Path
from typing import Any

import anyio
import numpy as np
import pytest

from client_calls import done
from fingersplit.dataset import Dataset
from fingersplit.hands import load_hand
from fingersplit.objects.loading import load_object
from fingersplit.planning.planning import plan
from fingersplit.transforms import pose_matrix, rotation_from_wxyz
from fingersplit_client import Client, scenes

pytestmark = pytest.mark.anyio
PATIENCE = 300


async def complete(client: Any, dataset_id: str) -> Any:
    """The data set once it is not being filled any more."""
    until = time.monotonic() + PATIENCE
    while (found := await done(client.datasets.get(dataset_id))).state == "running":
        assert time.monotonic() < until, found
        await anyio.sleep(0.05)
    return found


async def test_a_data_set_is_filled_downloaded_and_deleted(client: Any, can: bytes, tmp_path: Path) -> None:
    uploaded = await done(client.objects.upload(can, file_type="off", name="can"))
    asked = await done(
        client.datasets.create([uploaded], per_object=3, split=(1, 0, 0), licence="CC0", job={"starts": 6, "seed": 2})
    )
    found = await complete(client, asked.id)
    assert (found.state, found.failed, found.selected) == ("complete", 0, 3)
    shards = found.items[0].shards
    assert await done(client.datasets.download(asked.id, tmp_path)) == len(shards)
    assert await done(client.datasets.download(asked.id, tmp_path)) == 0
    dataset = Dataset(tmp_path)
    assert (dataset.request.licence, dataset.request.per_object, dataset.request.seed) == ("CC0", 3, 2)
    assert sum(int(shard.columns["selected"].sum()) for shard in dataset.shards("train")) == 3
    assert asked.id in [one.id for one in (await done(client.datasets.list())).items]
    assert (await done(client.datasets.cancel(asked.id))).state == "complete"
    await done(client.datasets.delete(asked.id))
    assert asked.id not in [one.id for one in (await done(client.datasets.list())).items]


def test_its_grasps_are_those_of_this_machine(service: str, can: bytes) -> None:
    with tempfile.TemporaryDirectory() as name, Client(service) as client:
        file, folder = Path(name) / "can.off", Path(name) / "set"
        file.write_bytes(can)
        uploaded = client.objects.upload(file)
        asked = client.datasets.create([uploaded], per_object=2, job={"starts": 6, "seed": 4})
        until = time.monotonic() + PATIENCE
        while client.datasets.get(asked.id).state == "running":
            assert time.monotonic() < until
            time.sleep(0.05)
        client.datasets.download(asked.id, folder)
        first = next(Dataset(folder).shards())
        here = plan(load_object(file), load_hand("barrett"), starts=6, seed=4, top_k=6)
        there = first.columns["joints"]
        names = list(first.hand["joint_names"])
        assert np.array_equal(there, [[grasp.joints[joint] for joint in names] for grasp in here.grasps])


def test_its_grasps_keep_clear_of_the_scene(service: str, can: bytes, tmp_path: Path) -> None:
    around = scenes.scene(scenes.box("wall", (0.4, 0.02, 0.3), (0.0, 0.06, 0.15)), supports=[scenes.table()])
    with Client(service) as client:
        uploaded = client.objects.upload(can, file_type="off", name="can")
        asked = client.datasets.create([uploaded], per_object=2, job={"starts": 8, "seed": 4, "scene": around})
        until = time.monotonic() + PATIENCE
        while (found := client.datasets.get(asked.id)).state == "running":
            assert time.monotonic() < until
            time.sleep(0.05)
        assert (found.state, found.selected) == ("complete", 2)
        client.datasets.download(asked.id, tmp_path)
    dataset = Dataset(tmp_path)
    assert [one["id"] for one in dataset.request.constraints["scene"]["obstacles"]] == ["wall"]
    for shard in dataset.shards():
        assert shard.scene is not None
        assert set(shard.scene["rejected_by"]) <= {"wall", "table"}
        place = shard.scene["object_pose"]
        in_world = pose_matrix(rotation_from_wxyz(place["wxyz"]), place["position"])
        for contacts in shard.columns["contact_position"][shard.columns["feasible"]]:
            assert (contacts @ in_world[1, :3] + in_world[1, 3]).max() < 0.05  # this side of the wall
