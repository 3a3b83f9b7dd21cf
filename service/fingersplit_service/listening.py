"""The server: silent, slow and endless connections are closed, and a stop ends all waits."""

import asyncio
import signal
import sys
from collections import OrderedDict
from contextlib import suppress
from types import FrameType
from typing import Any, ClassVar

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from fingersplit_service.limits import MAX_HEADER_BYTES
from fingersplit_service.settings import ServiceSettings
from fingersplit_service.telemetry.logs import configure_logs

__all__ = ["serve_app"]

_FOR_PROBES = 64  # connections beyond the most: probes are answered on them, and refusals
_GRACE = 10  # for answers under way when the service is told to stop [s]
_TOO_LARGE = (
    b"HTTP/1.1 431 Request Header Fields Too Large\r\nContent-Type: application/problem+json\r\n"
    b"Content-Length: %d\r\nConnection: close\r\n\r\n%s"
)
_PROBLEM = (
    b'{"type":"urn:fingersplit:problem:headers-too-large","title":"Request header fields too large","status":431,'
    b'"detail":"The headers of a request may have at most %d bytes."}' % MAX_HEADER_BYTES
)


class _Protocol(HttpToolsProtocol):
    """A connection on which headers come in time and in size, and answers are read in time.

    Of connections that wait for a request there are at most as many as there may be at once: the one that has waited
    longest is closed for a new one, so silence cannot keep others out.
    """

    header_timeout_s: ClassVar[float]
    write_timeout_s: ClassVar[float]
    max_connections: ClassVar[int]
    silent: "ClassVar[OrderedDict[_Protocol, None]]"
    connected: ClassVar[set["_Protocol"]]
    _timer: asyncio.TimerHandle | None = None
    _write_timer: asyncio.TimerHandle | None = None
    _header_bytes, _reading_headers = 0, False

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self.connected.add(self)
        self._expect_headers()
        while len(self.connected) > self.max_connections + _FOR_PROBES and len(self.silent) > 1:
            next(iter(self.silent))._drop()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self._reading_headers:
            self._header_bytes += len(data)
            if self._header_bytes > MAX_HEADER_BYTES:
                self._stop_waiting()
                self.transport.write(_TOO_LARGE % (len(_PROBLEM), _PROBLEM))
                self.transport.close()

    def on_message_begin(self) -> None:
        super().on_message_begin()
        self._expect_headers()

    def on_headers_complete(self) -> None:
        self._stop_waiting()
        super().on_headers_complete()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        if self.cycle.response_complete and not self.transport.is_closing():  # else another is under way
            self.silent[self] = None

    def pause_writing(self) -> None:
        super().pause_writing()
        self._write_timer = self.loop.call_later(self.write_timeout_s, self._drop)

    def resume_writing(self) -> None:
        super().resume_writing()
        self._stop_write_timer()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_waiting()
        self._stop_write_timer()
        self.connected.discard(self)
        self.silent.pop(self, None)
        super().connection_lost(exc)

    def _expect_headers(self) -> None:
        self._stop_waiting()
        self._header_bytes, self._reading_headers = 0, True
        if self.cycle is None or self.cycle.response_complete:
            self.silent[self] = None
        self._timer = self.loop.call_later(self.header_timeout_s, self._drop)

    def _stop_waiting(self) -> None:
        self.silent.pop(self, None)
        self._reading_headers = False
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _stop_write_timer(self) -> None:
        if self._write_timer is not None:
            self._write_timer.cancel()
            self._write_timer = None

    def _drop(self) -> None:
        """Close the connection at once, whatever is left to read or write."""
        self.silent.pop(self, None)
        self.connected.discard(self)
        self.transport.abort()


class _Server(uvicorn.Server):
    """A server that, told to stop, answers for a while as not ready, then begins no more jobs and waits for none.

    Told again, it stops at once.
    """

    def __init__(self, config: uvicorn.Config, app: FastAPI, drain_s: float) -> None:
        super().__init__(config)
        self._app, self._drain_s, self._logged = app, drain_s, False
        self._loop: asyncio.AbstractEventLoop | None = None

    async def serve(self, sockets: list[Any] | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        await super().serve(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        runs = self._loop is not None and hasattr(self._app.state, "runtime")
        if runs and self._drain_s and not self._logged:
            self._logged = True
            self._app.state.runtime.health.draining = True
            assert self._loop is not None
            self._loop.call_soon_threadsafe(self._loop.call_later, self._drain_s, self.handle_exit, sig, frame)
            return
        super().handle_exit(sig, frame)
        if runs:
            assert self._loop is not None
            self._loop.call_soon_threadsafe(self._app.state.runtime.wind_down)


def serve_app(app: FastAPI, settings: ServiceSettings) -> None:
    """Serve an application until the process is told to stop."""
    configure_logs(settings.log_format, settings.log_level)
    limits = {
        "header_timeout_s": settings.header_timeout_s,
        "write_timeout_s": settings.write_timeout_s,
        "max_connections": settings.max_connections,
        "silent": OrderedDict(),
        "connected": set(),
    }
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        http=type("Protocol", (_Protocol,), limits),
        loop="uvloop",
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_GRACE,
    )
    # uvicorn repeats the signal once it has stopped cleanly, which is then the end and no fault.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with suppress(KeyboardInterrupt):
        _Server(config, app, settings.drain_s).run()
