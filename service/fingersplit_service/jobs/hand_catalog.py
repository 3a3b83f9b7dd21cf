"""The hands that can be planned for, as the workers know them: the service process loads no planner."""

from pydantic import TypeAdapter

from fingersplit_client.schemas import HandInfo
from fingersplit_service.jobs.errors import WorkersNotReady
from fingersplit_service.jobs.worker_pool import WorkerPool

__all__ = ["HandCatalog"]

_HANDS = TypeAdapter(list[HandInfo])


class HandCatalog:
    """The hands by what the first warm worker said of them.

    Args:
        pool: The workers.
    """

    def __init__(self, pool: WorkerPool) -> None:
        self._pool = pool
        self._hands: list[HandInfo] | None = None

    def all(self) -> list[HandInfo]:
        """Every hand.

        Raises:
            WorkersNotReady: No worker is warm yet.
        """
        if self._hands is None:
            if self._pool.warm_up is None:
                raise WorkersNotReady("The workers are still starting; try again in a second.")
            self._hands = _HANDS.validate_python(self._pool.warm_up.hands)
        return self._hands
