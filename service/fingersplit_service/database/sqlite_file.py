"""The file of a SQLite database: its connections, and whether it is still the one that was opened."""

import os
import sqlite3
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import sqlalchemy as sa

__all__ = ["SqliteFile"]

_BUSY_TIMEOUT = 2_000  # how long to wait for another process's lock [ms]
_OPENING_TIME, _OPENING_PAUSE = 30.0, 0.01  # how long, and how often, a file that others open too is tried [s]


class SqliteFile:
    """The file of a database: its connections, and whether it is still the one that was opened."""

    def __init__(self, name: str) -> None:
        self._path = Path(name)
        self._identity: tuple[int, int] | None = None
        self._writer: Any = None
        self._durable: bool | None = None

    def engine(self, url: sa.URL, *, reads_only: bool) -> sa.Engine:
        """An engine of one connection."""
        options = {"check_same_thread": False, "cached_statements": 256}
        engine = sa.create_engine(url, poolclass=sa.StaticPool, connect_args=options)

        def configure(connection: Any, _record: Any) -> None:
            connection.isolation_level = None  # transactions begin as written below, not when the driver decides
            _write_ahead(connection)
            pragmas = [f"busy_timeout={_BUSY_TIMEOUT}", "foreign_keys=ON", "cache_size=-16384"]
            for pragma in [*pragmas, "query_only=ON"] if reads_only else pragmas:
                connection.execute(f"PRAGMA {pragma}")
            if not reads_only:
                self._writer = connection

        def begin(connection: sa.Connection) -> None:
            # A writer takes the lock first: what a transaction has read cannot change before it writes.
            connection.exec_driver_sql("BEGIN" if reads_only else "BEGIN IMMEDIATE")

        sa.event.listen(engine, "connect", configure)
        sa.event.listen(engine, "begin", begin)
        return engine

    def remember(self) -> None:
        """Note which file was opened."""
        self._identity = self._look()

    def check(self) -> None:
        """Refuse to work on a file that was deleted or replaced: what is written to it would be lost.

        Raises:
            OSError: It was.
        """
        if self._look() != self._identity:
            raise FileNotFoundError(f"{self._path} was replaced while the service runs.")

    def synchronize(self, durable: bool) -> None:
        """Set how safe the next commit is."""
        if durable is not self._durable:
            self._writer.execute(f"PRAGMA synchronous={'FULL' if durable else 'NORMAL'}")
            self._durable = durable

    def _look(self) -> tuple[int, int]:
        status = os.stat(self._path)
        return status.st_dev, status.st_ino


def _write_ahead(connection: sqlite3.Connection) -> None:
    """Let readers go on while one writes. SQLite does not wait for others that change a new file to this, too."""
    end = monotonic() + _OPENING_TIME
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
        except sqlite3.OperationalError as error:
            is_locked = error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY  # the rest says why
            if not is_locked or monotonic() > end:
                raise
            sleep(_OPENING_PAUSE)
        else:
            return
