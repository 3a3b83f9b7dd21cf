"""Filling a data set: objects side by side, round after round, each round kept as soon as it is there."""

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from fingersplit.dataset.folder import DatasetFolder
from fingersplit.dataset.planners import ObjectTask, Planner
from fingersplit.dataset.request import DatasetObject, DatasetRequest
from fingersplit.dataset.shards import ShardHead
from fingersplit.errors import DatasetError

__all__ = ["DatasetProgress", "make_dataset"]

POLL = 0.5
"""Between two looks at what is on disk [s]."""


@dataclass(frozen=True)
class DatasetProgress:
    """How far a data set is.

    Attributes:
        objects: Objects in all.
        done: Objects that are complete, or given up.
        failed: Those of them that have too few grasps, or none.
        wanted: Grasps wanted in all.
        selected: Grasps that count so far.
        grasps: Feasible grasps of this run.
        held: Grasps of this run that held in simulation.
        seconds: Time since this run began [s].
    """

    objects: int
    done: int
    failed: int
    wanted: int
    selected: int
    grasps: int
    held: int
    seconds: float

    @property
    def message(self) -> str:
        """The progress in a sentence."""
        per = max(self.seconds, 1e-9)
        return (
            f"{self.selected} of {self.wanted} grasps of {self.objects} objects, {self.failed} objects short; this run "
            f"found {self.grasps} feasible grasps ({self.grasps / per:.2f}/s), of which {self.held} held "
            f"({self.held / per:.2f}/s), in {self.seconds:.0f} s."
        )


def make_dataset(
    folder: Path,
    request: DatasetRequest,
    objects: Sequence[DatasetObject],
    files: Sequence[Path],
    planner: Planner,
    *,
    retry_failed: bool = False,
    progress: Callable[[DatasetProgress], None] = lambda _progress: None,
) -> DatasetProgress:
    """Plan, verify and keep grasps until every object has as many as wanted, or no more are found.

    What is on disk is never planned again: after a kill the same call goes on where the last whole round ended.

    Args:
        folder: Where the data set is.
        request: What it is to hold.
        objects: Its objects, from ``find_objects``.
        files: Their files, in the same order.
        planner: What plans a round, and how many at a time.
        retry_failed: Whether objects are tried again that failed earlier.
        progress: Called from time to time.

    Raises:
        DatasetError: The folder cannot be used.
    """
    kept = DatasetFolder(folder)
    with kept.begun(request, objects):
        if retry_failed:
            kept.forget_failures()
        ledger = _Ledger(kept, request, objects)
        tasks = [
            ObjectTask(folder, request, item, file.absolute())
            for item, file in zip(objects, files, strict=True)
            if not ledger.is_done(item)
        ]
        _work_off(tasks, planner, kept, lambda: progress(ledger.look()))
        last = ledger.look()
        progress(last)
    return last


def _work_off(tasks: Sequence[ObjectTask], planner: Planner, kept: DatasetFolder, look: Callable[[], None]) -> None:
    """Work on some objects at a time; one that breaks its worker twice is given up."""
    waiting, attempts = list(tasks), dict[int, int]()
    running = dict[Future[None], ObjectTask]()
    try:
        while waiting or running:
            while waiting and len(running) < planner.slots:
                task = waiting.pop(0)
                running[planner.submit(task, len(waiting) + len(running) + 1)] = task
            ended, _ = wait(running, timeout=POLL, return_when=FIRST_COMPLETED)
            for future in ended:
                task = running.pop(future)
                if (death := planner.death_of(future)) is None:
                    future.result()
                    continue
                attempts[task.item.index] = attempts.get(task.item.index, 0) + 1
                if attempts[task.item.index] > 1:
                    kept.fail(task.item, "worker_died", death)
                else:
                    waiting.append(task)  # last, so that it takes no others with it again
            look()
    finally:
        for future in running:
            future.cancel()
        planner.close()


class _Ledger:
    """What is on disk, counted."""

    def __init__(self, kept: DatasetFolder, request: DatasetRequest, objects: Sequence[DatasetObject]) -> None:
        self._kept, self._order, self._objects = kept, request, objects
        self._heads = dict[Path, ShardHead]()
        self._began = perf_counter()
        self._read()
        self._earlier = set(self._heads)

    def is_done(self, item: DatasetObject) -> bool:
        """Whether nothing is left to do for an object."""
        return self._selected().get(item.index, 0) >= self._order.per_object or item.index in self._kept.failures()

    def look(self) -> DatasetProgress:
        """The progress as it is on disk now."""
        self._read()
        selected, failures = self._selected(), self._kept.failures()
        fresh = [head for path, head in self._heads.items() if path not in self._earlier]
        complete = {index for index, count in selected.items() if count >= self._order.per_object}
        return DatasetProgress(
            objects=len(self._objects),
            done=len(complete | failures.keys()),
            failed=len(failures),
            wanted=len(self._objects) * self._order.per_object,
            selected=sum(selected.values()),
            grasps=sum(head.feasible for head in fresh),
            held=sum(head.held for head in fresh),
            seconds=perf_counter() - self._began,
        )

    def _read(self) -> None:
        known = {item.index: item for item in self._objects}
        for path in self._kept.shard_files():
            if path not in self._heads:
                index = int(path.name.partition("-")[0])
                if index not in known:
                    raise DatasetError(f"{path} belongs to no object of the manifest.")
                self._heads |= {head.path: head for head in self._kept.heads(known[index])}

    def _selected(self) -> dict[int, int]:
        counts = dict[int, int]()
        for head in self._heads.values():
            counts[head.index] = counts.get(head.index, 0) + head.selected
        return counts
