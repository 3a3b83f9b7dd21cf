"""The tables, and a database whose one writer lives in one thread."""

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from functools import partial, wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import sqlalchemy as sa

__all__ = ["Database", "in_database_thread", "jobs", "objects"]

Params = ParamSpec("Params")
Returned = TypeVar("Returned")
Owner = TypeVar("Owner", bound="Database")

_metadata = sa.MetaData()

objects = sa.Table(
    "objects",
    _metadata,
    sa.Column("id", sa.String(64), primary_key=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("document", sa.Text, nullable=False, comment="ObjectInfo as JSON"),
    sa.Column("created_at", sa.Float, nullable=False, comment="seconds since 1970, UTC"),
)

jobs = sa.Table(
    "jobs",
    _metadata,
    sa.Column("number", sa.Integer, primary_key=True, comment="order of acceptance"),
    sa.Column("id", sa.String(64), nullable=False, unique=True),
    sa.Column("object_id", sa.String(64), sa.ForeignKey("objects.id"), nullable=False),
    sa.Column("state", sa.String(16), nullable=False, index=True),
    sa.Column("request", sa.Text, nullable=False, comment="JobCreate as JSON"),
    sa.Column("result", sa.Text, comment="PlanResult as JSON"),
    sa.Column("grasps", sa.Integer, comment="number of grasps in the result"),
    sa.Column("error_code", sa.String(32)),
    sa.Column("error_detail", sa.Text),
    sa.Column("attempts", sa.Integer, nullable=False, comment="times handed to a worker, counted before"),
    sa.Column("worker_deaths", sa.Integer, nullable=False, comment="times its worker died of it"),
    sa.Column("created_at", sa.Float, nullable=False, comment="seconds since 1970, UTC"),
    sa.Column("started_at", sa.Float, comment="of the latest attempt"),
    sa.Column("finished_at", sa.Float),
)


class Database:
    """SQLite in WAL mode with one connection, used by one thread.

    More connections would only wait for each other's locks; an asynchronous driver costs more than a thread.

    Args:
        path: The database file; made when it does not exist.
    """

    def __init__(self, path: Path) -> None:
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="database")
        self._engine = sa.create_engine(
            f"sqlite:///{path}", poolclass=sa.StaticPool, connect_args={"check_same_thread": False}
        )
        sa.event.listen(self._engine, "connect", _configure_connection)
        sa.event.listen(self._engine, "begin", _begin_immediate)
        _metadata.create_all(self._engine)

    def close(self) -> None:
        """Finish what was asked for and close the file."""
        self._thread.shutdown()
        self._engine.dispose()

    async def in_thread(self, function: Callable[[], Returned]) -> Returned:
        """Run ``function`` in the thread of the database."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, function)


def in_database_thread(
    method: Callable[Concatenate[Owner, Params], Returned],
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    """Make a blocking method of a `Database` awaitable; calls run one after the other."""

    @wraps(method)
    async def awaited(self: Owner, /, *args: Params.args, **kwargs: Params.kwargs) -> Returned:
        return await self.in_thread(partial(method, self, *args, **kwargs))

    return awaited


def _configure_connection(connection: Any, _record: Any) -> None:
    connection.isolation_level = None  # transactions begin as written below, not at the driver's whim
    for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", "busy_timeout=5000"):
        connection.execute(f"PRAGMA {pragma}")


def _begin_immediate(connection: sa.Connection) -> None:
    """Take the write lock first: what a transaction has read cannot change before it writes."""
    connection.exec_driver_sql("BEGIN IMMEDIATE")
