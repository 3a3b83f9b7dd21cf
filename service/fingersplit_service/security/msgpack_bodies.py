"""Bodies as MessagePack wherever JSON goes: smaller, and files in them need no base64."""

import base64
import json
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fingersplit_service.problems import ProblemKind, problem_response

__all__ = ["MEDIA_TYPE", "MsgpackBodies"]

MEDIA_TYPE = "application/msgpack"
_NAMES = {MEDIA_TYPE, "application/x-msgpack", "application/vnd.msgpack"}
_JSON = ("application/json", "application/problem+json")


class MsgpackBodies:
    """Reads bodies of ``Content-Type: application/msgpack``, and answers so where ``Accept`` names it.

    Binary values of a request stand for what JSON has as base64, such as ``mesh.data`` of ``POST /v1/plan``.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        headers = Headers(scope=scope) if scope["type"] == "http" else Headers()
        packed, wanted = _is_msgpack(headers.get("content-type", "")), _wants_msgpack(headers.get("accept", ""))
        if not packed and not wanted:
            await self._app(scope, receive, send)
            return
        try:
            import msgpack
        except ImportError:
            detail = "This service reads and writes JSON; for MessagePack it needs fingersplit-service[msgpack]."
            await problem_response(ProblemKind.MEDIA_TYPE.document(detail))(scope, receive, send)
            return
        answer = _Answer(send) if wanted else None
        sender = answer.send if answer else send
        if packed:
            body = await _whole(receive)
            try:
                document = msgpack.unpackb(body)
                text = json.dumps(document, default=_as_text, allow_nan=False).encode()
            except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
                detail = f"The body is no MessagePack of JSON's types: {error or type(error).__name__}."
                await problem_response(ProblemKind.INVALID_REQUEST.document(detail))(scope, receive, sender)
                return
            scope = {**scope, "headers": _as_json(scope["headers"], len(text))}
            receive = _sent(text, receive)
        await self._app(scope, receive, sender)


class _Answer:
    """An answer that is held back until it is whole, if it is JSON, and sent as MessagePack."""

    def __init__(self, send: Send) -> None:
        self._send, self._parts = send, list[bytes]()
        self._start: Message | None = None

    async def send(self, message: Message) -> None:
        """One message of the application."""
        import msgpack

        if message["type"] == "http.response.start":
            if Headers(raw=message["headers"]).get("content-type", "").partition(";")[0].strip() in _JSON:
                self._start = message
                return
        elif self._start is not None and message["type"] == "http.response.body":
            self._parts.append(message.get("body", b""))
            if message.get("more_body"):
                return
            start, self._start = self._start, None
            body = b"".join(self._parts)
            packed: bytes = msgpack.packb(json.loads(body)) if body else b""
            changed = MutableHeaders(raw=list(start["headers"]))
            changed["content-type"] = MEDIA_TYPE
            changed["content-length"] = str(len(packed))
            changed.add_vary_header("Accept")
            await self._send({**start, "headers": changed.raw})
            message = {"type": "http.response.body", "body": packed}
        await self._send(message)


def _is_msgpack(content_type: str) -> bool:
    return content_type.partition(";")[0].strip().lower() in _NAMES


def _wants_msgpack(accept: str) -> bool:
    return any(_is_msgpack(part) for part in accept.split(","))


def _as_text(value: Any) -> str:
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    raise TypeError(f"{type(value).__name__} is not a type of JSON")


def _as_json(headers: list[tuple[bytes, bytes]], length: int) -> list[tuple[bytes, bytes]]:
    kept = [(name, value) for name, value in headers if name not in (b"content-type", b"content-length")]
    return [*kept, (b"content-type", b"application/json"), (b"content-length", str(length).encode())]


async def _whole(receive: Receive) -> bytes:
    """The body; its length is limited before it comes here."""
    parts = []
    while True:
        message = await receive()
        parts.append(message.get("body", b""))
        if message["type"] != "http.request" or not message.get("more_body"):
            return b"".join(parts)


def _sent(body: bytes, rest: Receive) -> Receive:
    """A body that is received at once, and what comes after it: that the client has gone."""
    messages: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def receive() -> Message:
        return messages.pop() if messages else await rest()

    return receive
