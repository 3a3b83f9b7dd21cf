"""A data set planned by a service."""

from pathlib import Path

from fingersplit.dataset import Dataset, DatasetRequest, find_objects, make_dataset
from fingersplit.dataset.planners import ServicePlanner
from fingersplit_client import Client
from fingersplit_client.rounds import connect


def test_a_service_fills_a_data_set(service: str, can: bytes, tmp_path: Path) -> None:
    (tmp_path / "can.off").write_bytes(can)
    (tmp_path / "bad.ply").write_bytes(b"ply")
    order = DatasetRequest(per_object=3, starts=6, mass=0.25, seed=4)
    items, files, _ = find_objects([tmp_path], order.split)
    folder = tmp_path / "set"
    last = make_dataset(folder, order, items, files, ServicePlanner(connect(service), 2))
    assert (last.selected, last.failed) == (3, 1)
    dataset = Dataset(folder)
    shard = next(dataset.shards())
    assert shard.object["mass"] == 0.25
    assert shard.attributes["seed"] == 4
    (failure,) = dataset.failures().values()
    assert failure["code"] == "refused"
    assert "(HTTP 422)" in failure["message"]
    with Client(service) as client:
        assert {job.object_name for job in client.jobs.all(object_name="can")} == {"can"}
