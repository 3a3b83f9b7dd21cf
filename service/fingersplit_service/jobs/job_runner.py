"""Who runs jobs, as the service that accepts them sees it."""

from collections.abc import Collection
from typing import Protocol

from fingersplit_service.jobs.cluster_notifier import ClusterNotifier

__all__ = ["JobRunner", "OtherMachines"]


class JobRunner(Protocol):
    """Runs the jobs of the table."""

    def wake(self, objects: Collection[str] = ()) -> None:
        """Say that jobs were queued, one for each of these objects."""

    def interrupt(self, job_id: str) -> None:
        """Free the core of a job that was cancelled."""

    def stop_claiming(self) -> None:
        """Begin nothing new."""


class OtherMachines:
    """Jobs run on other machines, which hear of them through the notifier.

    Args:
        notifier: Where they listen.
    """

    def __init__(self, notifier: ClusterNotifier) -> None:
        self._notifier = notifier

    def wake(self, objects: Collection[str] = ()) -> None:
        """Say that jobs were queued, one for each of these objects."""
        self._notifier.publish_queued(objects)

    def interrupt(self, job_id: str) -> None:
        """Nothing more: that a job was cancelled was published, and whoever runs it ends it."""

    def stop_claiming(self) -> None:
        """Nothing: other machines go on."""
