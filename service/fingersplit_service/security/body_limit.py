"""Request bodies are counted and timed while they stream in, whatever their headers say."""

import asyncio
from collections.abc import Callable

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["BodyLimit"]


class BodyLimit:
    """Middleware that ends a request whose body is too large with 413, and one whose body is too slow with 408.

    A connection with an unread rest of a body is closed after the answer: the rest is not read to its end.

    Args:
        app: The application.
        limit_of: Largest body for a method and a path [bytes].
        timeout_s: Longest time for a body to come in [s].
    """

    def __init__(self, app: ASGIApp, limit_of: Callable[[str, str], int], timeout_s: float) -> None:
        self._app, self._limit_of, self._timeout_s = app, limit_of, timeout_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on with a ``receive`` that counts."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit, received, complete = self._limit_of(scope["method"], scope["path"]), 0, False
        headers = dict(scope["headers"])
        announced = headers.get(b"content-length", b"")
        has_body = announced not in (b"", b"0") or b"transfer-encoding" in headers
        too_large = announced.isdigit() and int(announced[:20]) > limit
        deadline = asyncio.get_running_loop().time() + self._timeout_s

        async def counted_receive() -> Message:
            nonlocal received, complete
            if complete:  # what comes now is the end of the connection
                return await receive()
            message: Message = {}
            if not too_large:
                try:
                    async with asyncio.timeout_at(deadline):
                        message = await receive()
                except TimeoutError:
                    detail = f"The request's body took longer than {self._timeout_s:g} s."
                    raise ProblemError(ProblemKind.TOO_SLOW, detail) from None
            received += len(message.get("body", b""))
            complete = not message.get("more_body", False)
            if too_large or received > limit:
                raise ProblemError(
                    ProblemKind.TOO_LARGE, f"The request's body may have at most {limit} bytes.", limit=limit
                )
            return message

        async def send_closing(message: Message) -> None:
            if message["type"] == "http.response.start" and not complete and has_body:
                MutableHeaders(scope=message)["Connection"] = "close"
            await send(message)

        await self._app(scope, counted_receive, send_closing)
