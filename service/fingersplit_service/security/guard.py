"""Around every request: its id, what the page of a stranger may not do, headers of the answer, log line and metrics."""

import logging
import re
import time
from urllib.parse import urlsplit
from uuid import uuid4

from fastapi.datastructures import Headers
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fingersplit_client.schemas import Problem
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.operations.logs import log_context
from fingersplit_service.operations.metrics import Metrics
from fingersplit_service.operations.tracing import span
from fingersplit_service.problems import ProblemKind, problem_response
from fingersplit_service.settings import ServiceSettings, is_loopback

__all__ = ["Guard"]

_log = logging.getLogger(__name__)
_REQUEST_ID = re.compile(r"[A-Za-z0-9_.-]{1,64}")
_PROBES = {"/healthz", "/readyz", "/metrics"}
_SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}
_PAGE_POLICY = (
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'{inline}; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' data: blob:; worker-src 'self' blob:; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Guard:
    """Middleware around everything else.

    Args:
        app: The application.
        settings: Whom to listen to.
        metrics: Where requests are counted.
    """

    def __init__(self, app: ASGIApp, settings: ServiceSettings, metrics: Metrics) -> None:
        self._app, self._settings, self._metrics = app, settings, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        given = headers.get("x-request-id", "")
        request_id = given if _REQUEST_ID.fullmatch(given) else uuid4().hex
        began, status = time.perf_counter(), 500

        async def send_guarded(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                self._complete(MutableHeaders(scope=message), scope["path"], request_id)
            await send(message)

        with log_context(request_id=request_id), span("request", method=scope["method"], path=scope["path"]):
            try:
                refusal = await self._refusal(scope, headers)
                if refusal is None:
                    await self._app(scope, receive, send_guarded)
                else:
                    await problem_response(refusal)(scope, receive, send_guarded)
            finally:
                seconds = time.perf_counter() - began
                route = getattr(scope.get("route"), "path", "none")
                self._metrics.requests.labels(scope["method"], route, status).inc()
                self._metrics.answered.labels(route).observe(seconds)
                level = logging.DEBUG if route in _PROBES else logging.INFO
                _log.log(level, "%s %s %d %.1f ms", scope["method"], scope["path"], status, 1e3 * seconds)

    async def _refusal(self, scope: Scope, headers: Headers) -> Problem | None:
        """Why a request is refused whoever asks: what a stranger's page makes a browser on this machine send."""
        host = headers.get("host", "")
        origin = headers.get("origin")
        if scope["method"] not in _SAFE_METHODS and origin is not None and urlsplit(origin).netloc != host:
            return ProblemKind.FORBIDDEN.document(f"A page of {origin!r} may not change anything here.")
        try:
            if self._settings.allow_unauthenticated or not await scope["app"].state.runtime.access.open():
                return None
        except StorageUnavailable:
            return ProblemKind.STORAGE.document("Who may ask is not known now; try again.")
        # Without keys all that keeps strangers out is that they are not on this machine; a name that a stranger's
        # server resolves to this address would make their page look as if it were.
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            name = ""
        if is_loopback(name) or name in self._settings.allowed_hosts:
            return None
        detail = f"This service is not {host!r}; address it as localhost, or set FINGERSPLIT_ALLOWED_HOSTS."
        return ProblemKind.FORBIDDEN.document(detail)

    @staticmethod
    def _complete(headers: MutableHeaders, path: str, request_id: str) -> None:
        headers["X-Request-ID"] = request_id
        for name, value in _HEADERS.items():
            headers.setdefault(name, value)
        if headers.get("content-type", "").startswith("text/html"):
            inline = " 'unsafe-inline'" if path == "/docs" else ""  # FastAPI's page starts its viewer with one
            headers.setdefault("Content-Security-Policy", _PAGE_POLICY.format(inline=inline))
        if path.startswith("/v1/"):
            headers.setdefault("Cache-Control", "no-store")
