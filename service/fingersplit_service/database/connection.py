"""A database whose one writer lives in one thread."""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from functools import wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import sqlalchemy as sa

from fingersplit_service.database.schema import upgrade_schema

__all__ = ["Database", "StorageUnavailable", "Store", "accepting", "database_url", "reading", "transaction"]

Params = ParamSpec("Params")
Returned = TypeVar("Returned")
Owner = TypeVar("Owner", bound="Store")

_BUSY_TIMEOUT = 2_000  # how long to wait for somebody else's lock [ms]
_log = logging.getLogger(__name__)


class StorageUnavailable(Exception):  # noqa: N818 -- names what is the case
    """The database cannot do what was asked now: disk full, locked by somebody else, or out of reach."""


def database_url(configured: str | None, file: Path) -> sa.URL:
    """Where the tables are: the configured PostgreSQL, else the file."""
    if configured is None:
        return sa.URL.create("sqlite", database=str(file))
    return sa.make_url(configured).set(drivername="postgresql+psycopg")


class Database:
    """One connection, used by one thread; its tables are brought up to date when it is opened.

    More connections to SQLite would only wait for each other's locks, and an asynchronous driver costs more than
    a thread.

    Args:
        url: A SQLite file, made when it does not exist, or a PostgreSQL database.

    Raises:
        StorageUnavailable: It cannot be opened.
    """

    def __init__(self, url: sa.URL) -> None:
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="database")
        self._sqlite: Any = None
        self._durable: bool | None = None
        if url.get_backend_name() == "sqlite":
            self.engine = sa.create_engine(
                url, poolclass=sa.StaticPool, connect_args={"check_same_thread": False, "cached_statements": 256}
            )
            sa.event.listen(self.engine, "connect", self._configure_sqlite)
            sa.event.listen(self.engine, "begin", _begin_immediate)
        else:
            self.engine = sa.create_engine(url, pool_size=1, max_overflow=0, pool_pre_ping=True)
        self._views = {reads: self.engine.execution_options(reads_only=reads) for reads in (False, True)}
        try:
            upgrade_schema(self.engine)
        except sa.exc.OperationalError as error:
            self.close()
            raise StorageUnavailable(f"The database cannot be opened: {error.orig}") from error

    def close(self) -> None:
        """Finish what was asked for and close the connection."""
        self._thread.shutdown()
        self.engine.dispose()

    async def run(
        self, function: Callable[[sa.Connection], Returned], *, durable: bool = False, reads_only: bool = False
    ) -> Returned:
        """Run ``function`` in a transaction, in the thread of the database; once it returned all is committed.

        Args:
            function: What to do.
            durable: Whether it must survive a loss of power; it survives the end of this process in any case.
            reads_only: Whether it changes nothing, so that it need not wait for somebody else's lock.

        Raises:
            StorageUnavailable: Nothing was changed.
        """
        return await asyncio.get_running_loop().run_in_executor(
            self._thread, self._transact, function, durable, reads_only
        )

    def _transact(self, function: Callable[[sa.Connection], Returned], durable: bool, reads_only: bool) -> Returned:
        try:
            if self._sqlite is not None and durable is not self._durable:
                self._sqlite.execute(f"PRAGMA synchronous={'FULL' if durable else 'NORMAL'}")
                self._durable = durable
            with self._views[reads_only].begin() as connection:
                return function(connection)
        except (sa.exc.OperationalError, sa.exc.InterfaceError, sa.exc.TimeoutError) as error:
            _log.error("The database failed: %s", error.__cause__ or error)
            raise StorageUnavailable("The database cannot be written now: it is locked, full or away.") from error

    def _configure_sqlite(self, connection: Any, _record: Any) -> None:
        connection.isolation_level = None  # transactions begin as written below, not at the driver's whim
        pragmas = (f"busy_timeout={_BUSY_TIMEOUT}", "journal_mode=WAL", "foreign_keys=ON", "cache_size=-16384")
        for pragma in pragmas:
            connection.execute(f"PRAGMA {pragma}")
        self._sqlite = connection


class Store:
    """What one subject keeps in the database; its methods are transactions.

    Args:
        database: Where.
    """

    def __init__(self, database: Database) -> None:
        self._database = database


def transaction(
    method: Callable[Concatenate[Owner, sa.Connection, Params], Returned],
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    """Make a method that is given a connection an awaitable one without; calls run one after the other.

    A loss of power may undo the last ones: a job is then run again. What must not be undone is `accepting`.
    """
    return _awaitable(method)


def accepting(
    method: Callable[Concatenate[Owner, sa.Connection, Params], Returned],
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    """Like `transaction`, for what somebody is told to be kept: it is on disk before the method returns."""
    return _awaitable(method, durable=True)


def reading(
    method: Callable[Concatenate[Owner, sa.Connection, Params], Returned],
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    """Like `transaction`, for what changes nothing."""
    return _awaitable(method, reads_only=True)


def _awaitable(
    method: Callable[Concatenate[Owner, sa.Connection, Params], Returned],
    *,
    durable: bool = False,
    reads_only: bool = False,
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    @wraps(method)
    async def awaited(self: Owner, /, *args: Params.args, **kwargs: Params.kwargs) -> Returned:
        def act(connection: sa.Connection) -> Returned:
            return method(self, connection, *args, **kwargs)

        return await self._database.run(act, durable=durable, reads_only=reads_only)

    return awaited


def _begin_immediate(connection: sa.Connection) -> None:
    """Take the write lock first: what a transaction has read cannot change before it writes."""
    reads_only = connection.get_execution_options().get("reads_only", False)
    connection.exec_driver_sql("BEGIN" if reads_only else "BEGIN IMMEDIATE")
