"""A database: of SQLite one writer and one reader, each a connection in a thread of its own; of PostgreSQL some."""

import asyncio
import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import sqlalchemy as sa

from fingersplit_service.database.schema import upgrade_schema
from fingersplit_service.database.sqlite_file import SqliteFile

__all__ = [
    "Database",
    "DatabaseInUse",
    "StorageUnavailable",
    "database_url",
]

Returned = TypeVar("Returned")

_POSTGRESQL = {  # a machine that is gone answers nothing: it is given up after seconds, not after hours
    "connect_timeout": 5,
    "keepalives_idle": 5,
    "keepalives_interval": 2,
    "keepalives_count": 3,
    "tcp_user_timeout": 10_000,
}
_IDLE_IN_TRANSACTION = 3_000  # after which PostgreSQL ends a session that holds locks: its process was stopped [ms]
_TRUSTED = 0.5  # how long a connection counts as good after it was used [s]
_SERVICE_LOCK = 0x66696E67  # of PostgreSQL, held by the one service that works on a database
_log = logging.getLogger(__name__)


class StorageUnavailable(Exception):  # noqa: N818
    """The database cannot do what was asked now: disk full, locked, damaged, deleted or out of reach."""


class DatabaseInUse(Exception):  # noqa: N818
    """Another service works on the same database."""


def database_url(configured: str | None, file: Path) -> sa.URL:
    """Where the tables are: the configured PostgreSQL, else the file."""
    if configured is None:
        return sa.URL.create("sqlite", database=str(file))
    return sa.make_url(configured).set(drivername="postgresql+psycopg")


class Database:
    """Connections with threads of their own; the tables are brought up to date when it is opened.

    All writes to SQLite run one after the other in one thread: more connections would only wait for each other's locks,
    and an asynchronous driver costs more than a thread. Reads have a connection of their own, so that they do not wait
    for a write that is held up.

    Args:
        url: A SQLite file, made when it does not exist, or a PostgreSQL database.
        connections: How many transactions of either kind may run at once on PostgreSQL.

    Raises:
        StorageUnavailable: It cannot be opened.
    """

    def __init__(self, url: sa.URL, connections: int = 1) -> None:
        at_once = 1 if url.get_backend_name() == "sqlite" else connections
        self._threads = {
            name: ThreadPoolExecutor(at_once, thread_name_prefix=f"database-{name}") for name in ("write", "read")
        }
        self._file = SqliteFile(url.database) if url.get_backend_name() == "sqlite" and url.database else None
        if self._file is not None:
            self.engine, self._reader = (self._file.engine(url, reads_only=reads) for reads in (False, True))
        else:
            self.engine = sa.create_engine(url, pool_size=2 * at_once, max_overflow=1, connect_args=_POSTGRESQL)
            _look_before_use(self.engine)
            _let_go_of_locks(self.engine)
            self._reader = self.engine.execution_options(isolation_level="AUTOCOMMIT")
        self._lock: sa.Connection | None = None
        try:
            upgrade_schema(self.engine)
            if self._file is not None:
                self._file.remember()
        except sa.exc.DatabaseError as error:
            self.close()
            raise StorageUnavailable(f"The database cannot be opened: {error.orig}") from error
        except Exception:
            self.close()
            raise

    def close(self) -> None:
        """Finish what was asked for and close the connections."""
        for thread in self._threads.values():
            thread.shutdown()
        if self._lock is not None:
            self._lock.close()
        self._reader.dispose()
        self.engine.dispose()

    def lock(self, *, shared: bool = False) -> None:
        """Hold the database for one service as long as it is open; a file is held with its data directory.

        The lock belongs to a session: behind a pooler that shares sessions it guards nothing.

        Args:
            shared: Whether it is one of several machines, which keep out only a service that works alone.

        Raises:
            DatabaseInUse: Another service holds it.
        """
        if self._file is not None:
            return
        self._lock = self.engine.connect().execution_options(isolation_level="AUTOCOMMIT")
        take = sa.func.pg_try_advisory_lock_shared if shared else sa.func.pg_try_advisory_lock
        if not self._lock.execute(sa.select(take(_SERVICE_LOCK))).scalar():
            raise DatabaseInUse(
                "Another service works on this database; stop it, name another database, or share the work: set "
                "FINGERSPLIT_STORAGE_URL for all of them."
            )

    @contextmanager
    def long_transaction(self) -> Iterator[sa.Connection]:
        """A transaction that may stand still for as long as it likes, as while files are copied between statements."""
        with self.engine.begin() as connection:
            if self.is_postgresql:
                connection.exec_driver_sql("SET LOCAL idle_in_transaction_session_timeout = 0")
            yield connection

    @property
    def is_postgresql(self) -> bool:
        """Whether other processes may write to it at the same time."""
        return self._file is None

    async def run(
        self,
        function: Callable[[sa.Connection], Returned],
        *,
        durable: bool = False,
        reads_only: bool = False,
        single: bool = False,
    ) -> Returned:
        """Run ``function`` in a transaction, in the thread of the database; once it returned all is committed.

        What only reads, or is a single statement, needs no BEGIN and COMMIT on PostgreSQL, two trips less.

        Args:
            function: What to do.
            durable: Whether it must survive a loss of power; it survives the end of this process in any case.
            reads_only: Whether it changes nothing, so that it need not wait for a lock.
            single: Whether it is one statement on PostgreSQL.

        Raises:
            StorageUnavailable: Nothing was changed.
        """
        thread = self._threads["read" if reads_only else "write"]
        engine = self._reader if reads_only or (single and self.is_postgresql) else self.engine
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(thread, self._transact, function, engine, durable, reads_only)

    def _transact(
        self, function: Callable[[sa.Connection], Returned], engine: sa.Engine, durable: bool, reads_only: bool
    ) -> Returned:
        try:
            if self._file is not None:
                self._file.check()
                if not reads_only:
                    self._file.synchronize(durable)
            with engine.begin() as connection:
                return function(connection)
        except (sa.exc.IntegrityError, sa.exc.DataError, sa.exc.ProgrammingError):
            raise  # a fault of the request or of ours, not of the database
        except (sa.exc.DatabaseError, sa.exc.InterfaceError, sa.exc.TimeoutError, OSError) as error:
            _log.error("The database failed: %s", error.__cause__ or error)
            raise StorageUnavailable("The database is locked, full, damaged or out of reach.") from error


def _look_before_use(engine: sa.Engine) -> None:
    """Have connections that were not used for a moment tried first, since the database may have been restarted."""

    def note(_connection: Any, record: Any) -> None:
        record.info["used"] = time.monotonic()

    def look(connection: Any, record: Any, _proxy: Any) -> None:
        if time.monotonic() - record.info.get("used", time.monotonic()) > _TRUSTED:
            try:
                engine.dialect.do_ping(connection)
            except Exception as error:
                raise sa.exc.DisconnectionError from error  # another is made

    sa.event.listen(engine, "checkin", note)
    sa.event.listen(engine, "checkout", look)


def _let_go_of_locks(engine: sa.Engine) -> None:
    """Have the database end a transaction whose process stands still, so that nobody waits for its locks for ever.

    It is set in the session and not when connecting, since poolers refuse settings that they do not know.
    """

    def configure(connection: Any, _record: Any) -> None:
        connection.execute(f"SET idle_in_transaction_session_timeout = {_IDLE_IN_TRANSACTION}")
        connection.commit()

    sa.event.listen(engine, "connect", configure)
