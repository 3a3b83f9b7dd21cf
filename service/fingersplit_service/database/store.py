"""What the tables' classes share: methods that are transactions, and rows that are inserted once."""

from collections.abc import Callable, Coroutine, Mapping
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from fingersplit_service.database.connection import Database

__all__ = ["Store", "accepting", "insert_missing", "reading", "statement", "transaction"]

Params = ParamSpec("Params")
Returned = TypeVar("Returned")
Owner = TypeVar("Owner", bound="Store")


class Store:
    """What one subject keeps in the database; its methods are transactions.

    Args:
        database: Where.
    """

    def __init__(self, database: Database) -> None:
        self._database = database


def insert_missing(connection: sa.Connection, table: sa.Table, row: Mapping[str, Any], unique: list[str]) -> bool:
    """Insert a row unless one with the same values in the columns ``unique`` is there; whether it was inserted."""
    dialect: Any = sqlite if connection.dialect.name == "sqlite" else postgresql
    insert = dialect.insert(table).values(row).on_conflict_do_nothing(index_elements=unique)
    # Not by the number of rows, which is kept of updates and deletions only.
    return connection.execute(insert.returning(table.c[unique[0]])).first() is not None


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
    """Like `transaction`, for what a client is told to be kept: it is on disk before the method returns."""
    return _awaitable(method, durable=True)


def statement(
    method: Callable[Concatenate[Owner, sa.Connection, Params], Returned],
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    """Like `transaction`, for what is one statement on PostgreSQL."""
    return _awaitable(method, single=True)


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
    single: bool = False,
) -> Callable[Concatenate[Owner, Params], Coroutine[Any, Any, Returned]]:
    @wraps(method)
    async def awaited(self: Owner, /, *args: Params.args, **kwargs: Params.kwargs) -> Returned:
        def act(connection: sa.Connection) -> Returned:
            return method(self, connection, *args, **kwargs)

        return await self._database.run(act, durable=durable, reads_only=reads_only, single=single)

    return awaited
