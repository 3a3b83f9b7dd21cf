"""What can be planned for and with, as the workers know it: the service process loads no planner."""

from typing import Any

from pydantic import TypeAdapter

from fingersplit_client.schemas import FileFormatInfo, HandInfo, MetricInfo, SourceInfo
from fingersplit_service.jobs.errors import WorkersNotReady
from fingersplit_service.jobs.worker_functions import WarmUpReport
from fingersplit_service.jobs.worker_pool import WorkerPool

__all__ = ["HandCatalog"]

_HANDS: TypeAdapter[list[HandInfo]] = TypeAdapter(list[HandInfo])
_METRICS: TypeAdapter[list[MetricInfo]] = TypeAdapter(list[MetricInfo])
_FORMATS: TypeAdapter[list[FileFormatInfo]] = TypeAdapter(list[FileFormatInfo])
_SOURCES: TypeAdapter[list[SourceInfo]] = TypeAdapter(list[SourceInfo])


class HandCatalog:
    """Hands, metrics, file formats and sources of parallel grasps, by what the first warm worker said of them.

    Every method raises ``WorkersNotReady`` while no worker is warm yet.

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
            self._hands = _HANDS.validate_python(self._report().hands)
        return self._hands

    def metrics(self) -> list[MetricInfo]:
        """Every metric of a grasp."""
        return _METRICS.validate_python(self._catalog("metrics"))

    def formats(self) -> list[FileFormatInfo]:
        """Every file format."""
        return _FORMATS.validate_python(self._catalog("formats"))

    def sources(self) -> list[SourceInfo]:
        """Every source of parallel grasps."""
        return _SOURCES.validate_python(self._catalog("sources"))

    def _catalog(self, kind: str) -> list[dict[str, Any]]:
        return self._report().catalogs.get(kind, [])

    def _report(self) -> WarmUpReport:
        if self._pool.warm_up is None:
            raise WorkersNotReady("The workers are still starting; try again in a second.")
        return self._pool.warm_up
