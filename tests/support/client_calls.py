"""One way to write down calls of both clients."""

import inspect
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any


async def done(value: Any) -> Any:
    """The result of an operation, blocking or awaited."""
    return await value if inspect.isawaitable(value) else value


async def items(stream: Any) -> list[Any]:
    """All items of a stream."""
    return [item async for item in stream] if hasattr(stream, "__aiter__") else list(stream)


@asynccontextmanager
async def opened(kind: Any, url: str, **settings: Any) -> AsyncIterator[Any]:
    """A client of one kind or the other, closed in the end."""
    client = kind(url, **settings)
    try:
        yield client
    finally:
        await done(client.close())
