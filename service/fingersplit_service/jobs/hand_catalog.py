"""What can be planned for and with, as the workers know it: the service process loads no planner."""

from typing import Any

from pydantic import TypeAdapter

from fingersplit_client.schemas import ControllerInfo, FileFormatInfo, HandInfo, MetricInfo, ProtocolInfo, SourceInfo
from fingersplit_service.database.hands import HandStore
from fingersplit_service.jobs.errors import WorkersNotReady
from fingersplit_service.jobs.worker_functions import WarmUpReport
from fingersplit_service.jobs.worker_pool import WorkerPool

__all__ = ["HandCatalog"]

_HANDS: TypeAdapter[list[HandInfo]] = TypeAdapter(list[HandInfo])
_METRICS: TypeAdapter[list[MetricInfo]] = TypeAdapter(list[MetricInfo])
_FORMATS: TypeAdapter[list[FileFormatInfo]] = TypeAdapter(list[FileFormatInfo])
_SOURCES: TypeAdapter[list[SourceInfo]] = TypeAdapter(list[SourceInfo])
_PROTOCOLS: TypeAdapter[list[ProtocolInfo]] = TypeAdapter(list[ProtocolInfo])
_CONTROLLERS: TypeAdapter[list[ControllerInfo]] = TypeAdapter(list[ControllerInfo])


class HandCatalog:
    """Hands and the planner's registries: what the first warm worker said, and uploaded hands.

    Every method raises ``WorkersNotReady`` while no worker is warm yet.

    Args:
        pool: The workers.
        uploaded: The uploaded hands.
    """

    def __init__(self, pool: WorkerPool, uploaded: HandStore) -> None:
        self._pool, self._uploaded = pool, uploaded
        self._shipped: dict[str, HandInfo] | None = None

    def shipped(self) -> list[HandInfo]:
        """Every hand that ships."""
        return list(self._shipped_by_name().values())

    def is_shipped(self, name: str) -> bool:
        """Whether a hand of this name ships."""
        return name in self._shipped_by_name()

    async def find(self, owner: str, name: str) -> HandInfo | None:
        """A hand that ships or that the owner uploaded; None without one."""
        shipped = self._shipped_by_name().get(name)
        if shipped is not None:
            return shipped
        document = await self._uploaded.document(owner, name)
        return None if document is None else HandInfo.model_validate_json(document)

    def metrics(self) -> list[MetricInfo]:
        """Every metric of a grasp."""
        return _METRICS.validate_python(self._catalog("metrics"))

    def formats(self) -> list[FileFormatInfo]:
        """Every file format."""
        return _FORMATS.validate_python(self._catalog("formats"))

    def sources(self) -> list[SourceInfo]:
        """Every source of parallel grasps."""
        return _SOURCES.validate_python(self._catalog("sources"))

    def protocols(self) -> list[ProtocolInfo]:
        """Every verification protocol."""
        return _PROTOCOLS.validate_python(self._catalog("protocols"))

    def controllers(self) -> list[ControllerInfo]:
        """Every controller of the simulated hand."""
        return _CONTROLLERS.validate_python(self._catalog("controllers"))

    def _shipped_by_name(self) -> dict[str, HandInfo]:
        if self._shipped is None:
            self._shipped = {hand.name: hand for hand in _HANDS.validate_python(self._report().hands)}
        return self._shipped

    def _catalog(self, kind: str) -> list[dict[str, Any]]:
        return self._report().catalogs.get(kind, [])

    def _report(self) -> WarmUpReport:
        if self._pool.warm_up is None:
            raise WorkersNotReady("The workers are still starting; try again in a second.")
        return self._pool.warm_up
