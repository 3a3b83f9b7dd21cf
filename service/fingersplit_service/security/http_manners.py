"""What HTTP lets a client do with every resource: ask with HEAD, compress a body."""

import zlib
from collections.abc import Callable

from fastapi.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fingersplit_service.problems import ProblemError, ProblemKind, problem_response

__all__ = ["ContentDecoding", "HeadAsGet"]


class HeadAsGet:
    """Answers HEAD as GET is answered, without the body.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        answered = False

        async def receive_until_answered() -> Message:
            # A stream ends as if the client had gone: its headers are all that was asked for.
            return {"type": "http.disconnect"} if answered else await receive()

        async def send_headers(message: Message) -> None:
            nonlocal answered
            if message["type"] == "http.response.start":
                answered = True
                await send(message)
                await send({"type": "http.response.body", "body": b""})

        asked = {**scope, "method": "GET"}
        try:
            await self._app(asked, receive_until_answered, send_headers)
        finally:
            if "route" in asked:
                scope["route"] = asked["route"]  # for the log


class ContentDecoding:
    """Reads request bodies that were sent with ``Content-Encoding: gzip``; other encodings are refused.

    Args:
        app: The application.
        limit_of: Largest decoded body for a method and a path [bytes].
    """

    def __init__(self, app: ASGIApp, limit_of: Callable[[str, str], int]) -> None:
        self._app, self._limit_of = app, limit_of

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        encoding = Headers(scope=scope).get("content-encoding", "") if scope["type"] == "http" else ""
        if encoding.lower() in ("", "identity"):
            await self._app(scope, receive, send)
            return
        if encoding.lower() not in ("gzip", "x-gzip"):
            detail = f"The body's Content-Encoding is {encoding!r}; send it as it is, or with gzip."
            refusal = problem_response(ProblemKind.MEDIA_TYPE.document(detail), {"Accept-Encoding": "gzip"})
            await refusal(scope, receive, send)
            return
        headers = [(name, value) for name, value in scope["headers"] if name not in _OF_ENCODED]
        body = _Gunzip(receive, self._limit_of(scope["method"], scope["path"]))
        await self._app({**scope, "headers": headers}, body.receive, send)


_OF_ENCODED = {b"content-encoding", b"content-length"}
_CHUNK = 1 << 20  # [bytes]


class _Gunzip:
    """A body that is decompressed while it comes in."""

    def __init__(self, receive: Receive, limit: int) -> None:
        self._receive, self._limit = receive, limit
        self._stream = zlib.decompressobj(wbits=31)
        self._waiting, self._ended, self._decoded = b"", False, 0

    async def receive(self) -> Message:
        """The next part; at most a chunk at a time, so that little cannot become too much at once.

        Raises:
            zlib.error: The body is no gzip.
            ProblemError: It is larger than the limit.
        """
        while not self._waiting and not self._ended:
            message = await self._receive()
            if message["type"] != "http.request":
                return message
            self._waiting, self._ended = message.get("body", b""), not message.get("more_body", False)
        part = self._stream.decompress(self._waiting, _CHUNK)
        self._decoded += len(part)
        if self._decoded > self._limit:
            detail = f"The request's body may have at most {self._limit} bytes once it is decompressed."
            raise ProblemError(ProblemKind.TOO_LARGE, detail, limit=self._limit)
        self._waiting = self._stream.unconsumed_tail
        more = bool(self._waiting) or not self._ended
        if not more and not self._stream.eof:
            raise zlib.error("The compressed body is cut off.")
        return {"type": "http.request", "body": part, "more_body": more}
