"""Which worker has which objects ready: a job runs faster where its object was worked on before."""

from collections import OrderedDict
from collections.abc import Iterable

from fingersplit_service.jobs.slot import WorkerSlot

__all__ = ["WarmObjects"]

_REMEMBERED = 8  # objects that a worker is taken to have ready


class WarmObjects:
    """The objects that each worker used last.

    Args:
        slots: The workers.
    """

    def __init__(self, slots: Iterable[WorkerSlot]) -> None:
        self._ids: dict[WorkerSlot, OrderedDict[str, None]] = {slot: OrderedDict() for slot in slots}

    def has(self, slot: WorkerSlot, object_id: str) -> bool:
        """Whether a worker has an object ready."""
        return object_id in self._ids[slot]

    def of(self, slots: Iterable[WorkerSlot]) -> set[str]:
        """Ids of the objects that any of some workers has ready."""
        return {object_id for slot in slots for object_id in self._ids[slot]}

    def note(self, slot: WorkerSlot, object_id: str) -> None:
        """A worker works on an object."""
        known = self._ids[slot]
        known[object_id] = None
        known.move_to_end(object_id)
        if len(known) > _REMEMBERED:
            known.popitem(last=False)

    def forget(self, slot: WorkerSlot) -> None:
        """A worker has a new process."""
        self._ids[slot].clear()
