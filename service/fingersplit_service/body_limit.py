"""Request bodies are counted while they stream in, whatever their headers say."""

from collections.abc import Callable

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fingersplit_service.problems import ProblemError, ProblemKind

__all__ = ["BodyLimit"]


class BodyLimit:
    """Middleware that ends a request whose body grows past its limit with 413.

    Args:
        app: The application.
        limit_of: Largest body for a method and a path [bytes].
    """

    def __init__(self, app: ASGIApp, limit_of: Callable[[str, str], int]) -> None:
        self._app, self._limit_of = app, limit_of

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on with a ``receive`` that counts."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit, received = self._limit_of(scope["method"], scope["path"]), 0
        announced = dict(scope["headers"]).get(b"content-length", b"")
        too_large = announced.isdigit() and int(announced) > limit

        async def counted_receive() -> Message:
            nonlocal received
            message = {} if too_large else await receive()
            received += len(message.get("body", b""))
            if too_large or received > limit:
                raise ProblemError(
                    ProblemKind.TOO_LARGE, f"The request's body may have at most {limit} bytes.", limit=limit
                )
            return message

        await self._app(scope, counted_receive, send)
