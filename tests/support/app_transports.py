"""An application in this process for blocking and for awaited clients: it runs in an event loop of its own."""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import anyio
import httpx2
from anyio.from_thread import BlockingPortal, start_blocking_portal
from fastapi import FastAPI


@dataclass
class RunningApp:
    """An application whose lifespan has begun."""

    app: FastAPI
    portal: BlockingPortal

    async def handle(self, method: str, url: str, headers: list[tuple[bytes, bytes]], body: bytes) -> httpx2.Response:
        transport = httpx2.ASGITransport(self.app)
        response = await transport.handle_async_request(httpx2.Request(method, url, headers=headers, content=body))
        return httpx2.Response(response.status_code, headers=response.headers, content=await response.aread())

    def blocking(self) -> "BlockingTransport":
        return BlockingTransport(self)

    def awaited(self) -> "AwaitedTransport":
        return AwaitedTransport(self)


class BlockingTransport(httpx2.BaseTransport):
    def __init__(self, running: RunningApp) -> None:
        self._running = running

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        body = request.read()
        return self._running.portal.call(
            self._running.handle, request.method, str(request.url), request.headers.raw, body
        )


class AwaitedTransport(httpx2.AsyncBaseTransport):
    def __init__(self, running: RunningApp) -> None:
        self._running = running

    async def handle_async_request(self, request: httpx2.Request) -> httpx2.Response:
        body = await request.aread()
        future = self._running.portal.start_task_soon(
            self._running.handle, request.method, str(request.url), request.headers.raw, body
        )
        return await asyncio.wrap_future(future)


@contextmanager
def running_app(app: FastAPI) -> Iterator[RunningApp]:
    """An application between its start and its end."""
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(app.router.lifespan_context(app)):
        running = RunningApp(app, portal)
        portal.call(_until_ready, running)
        yield running


async def _until_ready(running: RunningApp) -> None:
    with anyio.fail_after(900):  # with nothing compiled yet it takes minutes
        while (await running.handle("GET", "http://localhost/readyz", [], b"")).status_code != 200:
            await anyio.sleep(0.05)
