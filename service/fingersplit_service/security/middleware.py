"""Around every request, from the outside in: its id, log line and metrics, headers of the answer, cross-site rules."""

import logging
import re
import time
from urllib.parse import urlsplit
from uuid import uuid4

from fastapi.datastructures import Headers
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fingersplit_client.schemas import Problem
from fingersplit_service.database.connection import StorageUnavailable
from fingersplit_service.problems import ProblemKind, problem_response
from fingersplit_service.security.access import KEY_NEEDED, identify
from fingersplit_service.settings import ServiceSettings, is_address, is_loopback
from fingersplit_service.telemetry.logs import log_context
from fingersplit_service.telemetry.metrics import Metrics
from fingersplit_service.telemetry.tracing import span

__all__ = ["AccessLog", "Authentication", "CrossSiteGuard", "RequestId", "RequestLimits", "SecurityHeaders"]

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


class RequestId:
    """Gives every request an id, the client's if it sent one, and every answer a header with it.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get("x-request-id", "")
        request_id = given if _REQUEST_ID.fullmatch(given) else uuid4().hex

        async def send_with_id(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message)["X-Request-ID"] = request_id
            await send(message)

        with log_context(request_id=request_id), span("request", method=scope["method"], path=scope["path"]):
            await self._app(scope, receive, send_with_id)


class AccessLog:
    """Writes a log line for every request and counts it.

    Args:
        app: The application.
        metrics: Where requests are counted.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, status = time.perf_counter(), 500

        async def send_noting(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, send_noting)
        finally:
            seconds = time.perf_counter() - began
            route = getattr(scope.get("route"), "path", "none")
            self._metrics.requests.labels(scope["method"], route, status).inc()
            self._metrics.answered.labels(route).observe(seconds)
            level = logging.DEBUG if route in _PROBES else logging.INFO
            owner = scope.get("state", {}).get("owner", "-")  # which is the id of a key
            line = "%s %s %d %.1f ms key=%s"
            _log.log(level, line, scope["method"], scope["path"], status, 1e3 * seconds, owner)


class SecurityHeaders:
    """Completes the headers of every answer: what a browser may do with it.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_completed(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._complete(MutableHeaders(scope=message), scope["path"])
            await send(message)

        await self._app(scope, receive, send_completed)

    @staticmethod
    def _complete(headers: MutableHeaders, path: str) -> None:
        for name, value in _HEADERS.items():
            headers.setdefault(name, value)
        if headers.get("content-type", "").startswith("text/html"):
            inline = " 'unsafe-inline'" if path == "/docs" else ""  # FastAPI's page starts its viewer with one
            headers.setdefault("Content-Security-Policy", _PAGE_POLICY.format(inline=inline))
        if path.startswith("/v1/"):
            headers.setdefault("Cache-Control", "no-store")


class RequestLimits:
    """Refuses requests beyond the most that may be under way, probes excepted, and too large headers.

    Args:
        app: The application.
        max_requests: Most requests under way at once.
        max_header_bytes: Largest headers of one request.
    """

    def __init__(self, app: ASGIApp, max_requests: int, max_header_bytes: int) -> None:
        self._app, self._max_requests, self._max_header_bytes = app, max_requests, max_header_bytes
        self._under_way = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or scope["path"] in _PROBES:
            await self._app(scope, receive, send)
            return
        size = sum(len(name) + len(value) for name, value in scope["headers"]) + len(scope["raw_path"] or b"")
        if size + len(scope["query_string"]) > self._max_header_bytes:
            detail = f"The headers of a request may have at most {self._max_header_bytes} bytes."
            problem = ProblemKind.HEADERS_TOO_LARGE.document(detail)
            await problem_response(problem, {"Connection": "close"})(scope, receive, send)
        elif self._under_way >= self._max_requests:
            problem = ProblemKind.OVERLOADED.document(f"{self._under_way} requests are under way; try again.")
            await problem_response(problem, {"Connection": "close"})(scope, receive, send)
        else:
            self._under_way += 1
            try:
                await self._app(scope, receive, send)
            finally:
                self._under_way -= 1


class Authentication:
    """Finds out who asks before anything of a request's body is read; the upload of an anonymous client is not read.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or not scope["path"].startswith("/v1/"):
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        try:
            principal = await identify(request)
        except StorageUnavailable:
            problem = ProblemKind.STORAGE.document("The API keys cannot be read now; try again.")
            await problem_response(problem, {"Connection": "close"})(scope, receive, send)
            return
        if principal is None:
            problem = ProblemKind.UNAUTHENTICATED.document(KEY_NEEDED)
            headers = {"WWW-Authenticate": "Bearer"}
            await problem_response(problem, headers)(scope, receive, send)
            return
        scope.setdefault("state", {})["owner"] = principal.owner
        await self._app(scope, receive, send)


class CrossSiteGuard:
    """Refuses what a page of another site makes a browser send, whoever's browser it is.

    Args:
        app: The application.
        settings: By which names the service may be addressed.
    """

    def __init__(self, app: ASGIApp, settings: ServiceSettings) -> None:
        self._app, self._settings = app, settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        refusal = await self._refusal(scope) if scope["type"] == "http" else None
        if refusal is None:
            await self._app(scope, receive, send)
        else:
            await problem_response(refusal)(scope, receive, send)

    async def _refusal(self, scope: Scope) -> Problem | None:
        if scope["path"] == "/healthz":
            return None  # says nothing but that the process is up
        headers = Headers(scope=scope)
        hosts, origin = headers.getlist("host"), headers.get("origin")
        if len(hosts) > 1:
            return ProblemKind.BAD_REQUEST.document("The request has more than one Host header.")
        host = hosts[0] if hosts else ""
        if origin is not None and origin in self._settings.cors_origins:
            return None  # with a key, or with the answer that one is needed
        if scope["method"] not in _SAFE_METHODS and origin is not None and urlsplit(origin).netloc != host:
            return ProblemKind.FORBIDDEN.document(f"A page of {origin!r} may not change anything here.")
        try:
            if not await scope["app"].state.runtime.access.open():
                return None
        except StorageUnavailable:
            return ProblemKind.STORAGE.document("The API keys cannot be read now; try again.")
        # Without keys only the network keeps strangers out. A page of theirs could get around that in a browser of
        # this network, by a name that their server resolves to this address.
        if headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-mode") != "navigate":
            return ProblemKind.FORBIDDEN.document("A page of another site may not use this service.")
        if self._may_be_called(host):
            return None
        detail = f"This service is not known as {host!r}; address it as localhost, or set FINGERSPLIT_ALLOWED_HOSTS."
        return ProblemKind.FORBIDDEN.document(detail)

    def _may_be_called(self, host: str) -> bool:
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if is_loopback(name) or name in self._settings.allowed_hosts:
            return True
        # Where everybody on the network may use it, its own address stands for it: a rebound name is never an address.
        return self._settings.allow_unauthenticated and is_address(name)
