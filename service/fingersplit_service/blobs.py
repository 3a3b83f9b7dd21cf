"""Files that machines share, in an object store: S3, Google Cloud Storage, Azure, or a folder that they all mount."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import timedelta
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from uuid import uuid4

if TYPE_CHECKING:
    from obstore.store import ObjectStore

__all__ = ["Blob", "BlobStore", "BlobsUnavailable"]

Returned = TypeVar("Returned")
_CONNECT_TIMEOUT, _TIMEOUT = timedelta(seconds=2), timedelta(seconds=30)  # of one request
_AT_ONCE = 1000  # deleted in one request


class BlobsUnavailable(OSError):  # noqa: N818
    """The object store does not answer."""


@dataclass(frozen=True)
class Blob:
    """An entry: its name, when it was last written [s since 1970] and its size [bytes]."""

    name: str
    modified: float
    size: int


@dataclass(frozen=True)
class BlobStore:
    """An object store by its address; a plain value, so worker processes hold the same.

    Credentials, region and endpoint come from the environment (``AWS_...``, ``GOOGLE_...``, ``AZURE_...``), as the
    store's own tools read them.

    Attributes:
        url: Such as ``s3://bucket/folder``, ``gs://bucket``, ``az://account/container`` or ``file:///mnt/shared``.
        retry_s: How long a request is repeated while the store does not answer [s].
    """

    url: str
    retry_s: float = 5.0

    @property
    def with_short_timeouts(self) -> "BlobStore":
        """The same store for what can be done without: nobody waits long for it."""
        return replace(self, retry_s=0.5)

    def put(self, name: str, file: Path) -> None:
        """Store a file; whole, or not at all.

        Raises:
            BlobsUnavailable: It is not stored.
        """
        self._try(lambda store: _obstore().put(store, name, file))

    def get(self, name: str, file: Path) -> None:
        """Write an entry to a file, which appears whole or not at all.

        Raises:
            FileNotFoundError: There is no such entry.
            BlobsUnavailable: The store does not answer.
        """
        content = self._try(lambda store: _obstore().get(store, name).bytes())
        file.parent.mkdir(parents=True, exist_ok=True)
        partial = file.with_name(f"{file.name}.{uuid4().hex}.partial")
        try:
            partial.write_bytes(content)
            partial.replace(file)
        finally:
            partial.unlink(missing_ok=True)

    def exists(self, name: str) -> bool:
        """Whether there is an entry.

        Raises:
            BlobsUnavailable: The store does not answer.
        """
        try:
            self._try(lambda store: _obstore().head(store, name))
        except FileNotFoundError:
            return False
        return True

    def entries(self, prefix: str) -> Iterator[Blob]:
        """The entries whose names begin with a folder, such as ``jobs/``.

        Raises:
            BlobsUnavailable: The store does not answer.
        """
        for part in self._try(lambda store: list(_obstore().list(store, prefix=prefix))):
            for found in part:
                yield Blob(found["path"], found["last_modified"].timestamp(), found["size"])

    def delete(self, names: list[str]) -> None:
        """Delete entries; one that is not there is no error.

        Raises:
            BlobsUnavailable: Some may be left.
        """
        for start in range(0, len(names), _AT_ONCE):
            some = names[start : start + _AT_ONCE]
            try:
                self._try(lambda store, some=some: _obstore().delete(store, some))  # type: ignore[misc]
            except FileNotFoundError:  # a folder says so, and leaves the others
                self._delete_singly(some)

    def _delete_singly(self, names: list[str]) -> None:
        for name in names:
            try:
                self._try(lambda store, name=name: _obstore().delete(store, name))  # type: ignore[misc]
            except FileNotFoundError:
                continue

    def _try(self, act: Callable[["ObjectStore"], Returned]) -> Returned:
        with _translated():
            return act(_open(self.url, self.retry_s, os.getpid()))


@contextmanager
def _translated() -> Iterator[None]:
    """Make the library's errors ours; that something is not there is an OSError already."""
    from obstore.exceptions import BaseError, NotFoundError

    try:
        yield
    except FileNotFoundError:
        raise
    except NotFoundError as error:
        raise FileNotFoundError(str(error).splitlines()[0]) from None
    except (BaseError, OSError) as error:
        raise BlobsUnavailable(str(error).splitlines()[0]) from None


def _obstore() -> Any:
    import obstore  # imported here: embedded services do without

    return obstore


@lru_cache(maxsize=8)
def _open(url: str, retry_s: float, _process: int) -> "ObjectStore":
    from obstore.store import from_url

    if url.startswith("file:"):
        return from_url(url, mkdir=True)
    pause = timedelta(seconds=1)
    return from_url(
        url,
        client_options={"connect_timeout": _CONNECT_TIMEOUT, "timeout": _TIMEOUT, "allow_http": url.startswith("s3")},
        retry_config={
            "max_retries": max(1, int(2 * retry_s)),
            "retry_timeout": timedelta(seconds=retry_s),
            "backoff": {"init_backoff": pause / 10, "max_backoff": pause, "base": 2},
        },
    )
