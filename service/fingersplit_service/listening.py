"""The server: connections without a request in time are closed, and a stop ends all waits."""

import asyncio
from contextlib import suppress
from types import FrameType
from typing import Any

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from fingersplit_service.operations.logs import configure_logs
from fingersplit_service.settings import ServiceSettings

__all__ = ["serve_app"]

_GRACE = 10  # for answers under way when the service is told to stop [s]


class _Protocol(HttpToolsProtocol):
    """A connection on which a request's headers must come in time."""

    header_timeout_s: float
    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._expect_headers()

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self._expect_headers()

    def on_headers_complete(self) -> None:
        self._stop_waiting()
        super().on_headers_complete()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_waiting()
        super().connection_lost(exc)

    def _expect_headers(self) -> None:
        self._stop_waiting()
        self._timer = self.loop.call_later(self.header_timeout_s, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class _Server(uvicorn.Server):
    """A server that ends all waits for jobs when it is told to stop."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app
        self._loop: asyncio.AbstractEventLoop | None = None

    async def serve(self, sockets: list[Any] | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        await super().serve(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        super().handle_exit(sig, frame)
        if self._loop is not None and hasattr(self._app.state, "runtime"):
            self._loop.call_soon_threadsafe(self._app.state.runtime.notifier.close)


def serve_app(app: FastAPI, settings: ServiceSettings) -> None:
    """Serve an application until the process is told to stop."""
    configure_logs(settings.log_format, settings.log_level)
    protocol = type("Protocol", (_Protocol,), {"header_timeout_s": settings.header_timeout_s})
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        http=protocol,
        loop="uvloop",
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        limit_concurrency=settings.max_connections,
        timeout_graceful_shutdown=_GRACE,
    )
    with suppress(KeyboardInterrupt):  # uvicorn repeats the signal once it has stopped cleanly
        _Server(config, app).run()
