"""What was computed of objects, shared among machines: each computes what no other has computed yet."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from fingersplit.cache import ContentCache
from fingersplit_service.blobs import BlobStore, BlobsUnavailable

__all__ = ["SharedCache"]

Arrays = dict[str, NDArray[Any]]


class SharedCache(ContentCache):
    """A folder of this machine in front of an object store; while that does not answer, the folder has to do.

    Keys stand for content and for the sources that computed it, so what another machine stored is what this one would
    compute; its checksums are compared when it is opened.

    Args:
        folder: As of `ContentCache`.
        limit_bytes: As of `ContentCache`.
        blobs: Where entries are shared.
    """

    def __init__(self, folder: Path, limit_bytes: int, blobs: BlobStore) -> None:
        super().__init__(folder, limit_bytes)
        self._blobs = blobs

    def fetch(self, key: str, build: Callable[[], Arrays]) -> Arrays:
        """The arrays of a key: of this machine, of another, or built."""
        entry, built = self.entry(key), False

        def note() -> Arrays:
            nonlocal built
            built = True
            return build()

        if not entry.exists():
            with suppress(OSError):  # nobody has it, or the store does not answer
                self._blobs.get(f"cache/{entry.name}", entry)
        arrays = super().fetch(key, note)
        if built and entry.exists():
            with suppress(BlobsUnavailable):
                self._blobs.put(f"cache/{entry.name}", entry)
        return arrays
