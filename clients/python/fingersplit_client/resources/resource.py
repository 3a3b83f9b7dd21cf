"""What all resources share."""

from typing import Generic

from fingersplit_client.modes import Bound, Mode

__all__ = ["Resource"]


class Resource(Bound[Mode], Generic[Mode]):
    """Operations of one subject.

    Args:
        mode: The client's connections.
    """

    def __init__(self, mode: Mode) -> None:
        self._connections = mode

    def _mode(self) -> Mode:
        return self._connections
