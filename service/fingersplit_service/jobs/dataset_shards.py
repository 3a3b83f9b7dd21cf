"""Shards of data sets, made by workers of the results of rounds."""

import json
from dataclasses import dataclass

from fingersplit.dataset.request import DatasetObject, DatasetRequest
from fingersplit_service.jobs.hand_work import stored_hand
from fingersplit_service.storage import Storage

__all__ = ["SHARD", "ShardTask", "write_shard_of"]

SHARD = "shard.h5"


@dataclass(frozen=True)
class ShardTask:
    """A shard for a worker to write.

    Attributes:
        job_id: The job that planned the round.
        item: The object.
        number: Number of the round.
        verified: Whether only grasps count that held.
        missing: Grasps that were missing when the round began.
        licence: Licence of the data set.
        result: The result document of the job, JSON.
    """

    job_id: str
    item: DatasetObject
    number: int
    verified: bool
    missing: int
    licence: str
    result: str = ""


def write_shard_of(storage: Storage, task: ShardTask) -> None:
    """Write a shard into the folder of its job, which must be there.

    Raises:
        ResultError: The result is of another version.
        FileNotFoundError: The job was deleted meanwhile.
    """
    from fingersplit.dataset.shards import selection, write_shard
    from fingersplit.result import PlanResult

    result = PlanResult.from_dict(json.loads(task.result))
    hand = result.active_grip(stored_hand(storage, result.hand))
    chosen = selection(result, task.verified, task.missing)
    with storage.atomic(storage.view(task.job_id, 0, SHARD), durable=False, make_folder=False) as staged:
        write_shard(staged, task.item, DatasetRequest(licence=task.licence), task.number, chosen, result, hand)
