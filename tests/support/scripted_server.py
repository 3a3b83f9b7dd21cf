"""A server that follows a script, one step for each request: it answers, refuses, cuts off, says nothing."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass
class Request:
    method: str
    path: str
    headers: dict[str, str]
    body: bytes
    connection: tuple[str, int]


@dataclass
class ScriptedServer:
    """Steps are taken in the order of the requests; the last one is repeated."""

    url: str
    steps: list["Step"]
    requests: list[Request] = field(default_factory=list)
    arrived: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    closing: threading.Event = field(default_factory=threading.Event)

    @property
    def connections(self) -> int:
        return len({request.connection for request in self.requests})


Step = Callable[[BaseHTTPRequestHandler, ScriptedServer], None]


def answers(document: Any = None, status: int = 200, **headers: str) -> Step:
    """An answer with a JSON document, or with bytes."""
    content = document if isinstance(document, bytes) else json.dumps(document).encode()

    def step(handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
        handler.send_response(status)
        for name, value in headers.items():
            handler.send_header(name.replace("_", "-"), value)
        handler.send_header("Content-Length", str(len(content)))
        handler.end_headers()
        handler.wfile.write(content)

    return step


def cuts(handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
    """The connection ends without an answer."""
    handler.close_connection = True


def cuts_midway(handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
    """The connection ends within the answer."""
    handler.send_response(200)
    handler.send_header("Content-Length", "1000")
    handler.end_headers()
    handler.wfile.write(b"{")
    handler.close_connection = True


def says_nothing(handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
    """No answer comes as long as the server lives."""
    server.closing.wait()
    handler.close_connection = True


def streams(*chunks: bytes, cut: bool = False) -> Step:
    """A stream of server-sent events that ends, or is cut."""

    def step(handler: BaseHTTPRequestHandler, server: ScriptedServer) -> None:
        handler.send_response(200)
        handler.send_header("Content-Type", "text/event-stream")
        handler.send_header("Transfer-Encoding", "chunked")
        handler.end_headers()
        for chunk in chunks:
            handler.wfile.write(b"%x\r\n%s\r\n" % (len(chunk), chunk))
        if cut:
            handler.close_connection = True
        else:
            handler.wfile.write(b"0\r\n\r\n")

    return step


@contextmanager
def scripted_server(*steps: Step) -> Iterator[ScriptedServer]:
    """A server on a free port of this machine."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def handle_one_request(self) -> None:
            try:
                super().handle_one_request()
            except ConnectionError:  # the client did not wait
                self.close_connection = True

        def _do(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            request = Request(self.command, self.path, dict(self.headers.items()), body, self.client_address)
            with lock:
                server.requests.append(request)
                step = server.steps.pop(0) if len(server.steps) > 1 else server.steps[0]
            server.arrived.release()
            step(self, server)

        do_GET = do_POST = do_DELETE = _do  # noqa: N815 -- names of http.server

        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 -- as http.server calls it
            pass

    lock = threading.Lock()
    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    http.daemon_threads = True
    server = ScriptedServer(f"http://127.0.0.1:{http.server_port}", list(steps))
    thread = threading.Thread(target=http.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.closing.set()
        http.shutdown()
        http.server_close()
        thread.join()
