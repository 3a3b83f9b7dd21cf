"""Drives flows with blocking calls."""

import queue
import threading
import time
from collections.abc import Generator, Iterator
from typing import Any, TypeVar

import httpx2

from fingersplit_client._exchange import Policy
from fingersplit_client._flow import (
    Abandon,
    Begin,
    Command,
    Emit,
    Flow,
    Interruption,
    NextEnded,
    NextLine,
    Open,
    Pause,
    Send,
    Stream,
    Work,
)

__all__ = ["Blocking"]

Result = TypeVar("Result")


_CLEANUP = 10.0
"""Most that threads may still take to clean up [s]; then they are left to themselves."""


class Blocking:
    """A client's connections, used with blocking calls; threads may share it.

    Args:
        http: The connections.
        policy: How requests are sent.
    """

    def __init__(self, http: httpx2.Client, policy: Policy) -> None:
        self._http, self.policy = http, policy

    def run(self, flow: Flow[Result]) -> Result:
        """Drive a flow to its end."""
        return _Drive(self._http).run(flow)

    def stream(self, flow: Stream[Result]) -> Generator[Result, None, None]:
        """Drive a flow and yield what it emits."""
        drive = _Drive(self._http)
        try:
            command = next(flow)
            while True:
                try:
                    if isinstance(command, Emit):
                        yield command.item
                        answer = None
                    else:
                        answer = drive.execute(command)
                except GeneratorExit:  # which would close what a flow delegates to, instead of telling it
                    command = flow.throw(Interruption())
                except BaseException as error:
                    command = flow.throw(error)
                else:
                    command = flow.send(answer)
        except (StopIteration, Interruption):
            pass
        finally:
            drive.close()


class _Drive:
    """One flow on its way: its opened answer, and the threads of the flows it has begun."""

    def __init__(self, http: httpx2.Client, abandoned: threading.Event | None = None) -> None:
        self._http = http
        self._abandoned = abandoned
        self._response: httpx2.Response | None = None
        self._lines: Iterator[str] = iter(())
        self._threads: _Threads | None = None

    def run(self, flow: Flow[Result]) -> Result:
        try:
            command = next(flow)
            while True:
                try:
                    self._check_abandoned()
                    answer = self.execute(command)
                except BaseException as error:
                    command = flow.throw(error)
                else:
                    command = flow.send(answer)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        finally:
            self.close()

    def execute(self, command: Command) -> Any:
        match command:
            case Open():
                return self._open(command)
            case Send():
                timeout = httpx2.Timeout(command.timeout, pool=None)
                return self._http.request(command.method, command.path, timeout=timeout, **command.arguments)
            case NextLine():
                return next(self._lines, None)
            case Pause():
                self._pause(command.seconds)
            case Work():
                return command.function()
            case Begin():
                self._threads = _Threads(self._http, command)
            case NextEnded():
                return self._threads.next_ended() if self._threads else None
            case Abandon():
                if self._threads:
                    self._threads.abandoned.set()
            case _:
                raise TypeError(f"{command} cannot be done here")
        return None

    def close(self) -> None:
        self._close_response()
        if self._threads:
            self._threads.close()

    def _open(self, command: Open) -> httpx2.Response:
        self._close_response()
        timeout = httpx2.Timeout(command.timeout, pool=None)
        request = self._http.build_request(command.method, command.path, timeout=timeout, **command.arguments)
        response = self._http.send(request, stream=True)
        if response.is_success:
            self._response, self._lines = response, response.iter_lines()
        else:
            response.read()
        return response

    def _close_response(self) -> None:
        if self._response is not None:
            self._response.close()
        self._response, self._lines = None, iter(())

    def _check_abandoned(self) -> None:
        if self._abandoned is not None and self._abandoned.is_set():
            self._abandoned = None  # what is cleaned up is no longer interrupted
            raise Interruption

    def _pause(self, seconds: float) -> None:
        if self._abandoned is None:
            time.sleep(seconds)
        else:
            self._abandoned.wait(seconds)


class _Threads:
    """Flows side by side, each in a thread; a new one is begun when one has ended."""

    def __init__(self, http: httpx2.Client, begin: Begin[Any]) -> None:
        self.abandoned = threading.Event()
        self._http = http
        self._flows = iter(begin.flows)
        self._ended: queue.SimpleQueue[tuple[threading.Thread, Any, BaseException | None]] = queue.SimpleQueue()
        self._running: set[threading.Thread] = set()
        for _ in range(begin.at_once):
            self._begin_next()

    def next_ended(self) -> Any:
        if not self._running:
            return None
        thread, result, error = self._ended.get()
        self._running.discard(thread)
        if error is not None:
            raise error
        self._begin_next()
        return result

    def close(self) -> None:
        self.abandoned.set()
        end = time.monotonic() + _CLEANUP
        for thread in self._running:
            thread.join(max(end - time.monotonic(), 0.0))

    def _begin_next(self) -> None:
        flow = next(self._flows, None)
        if flow is not None:
            thread = threading.Thread(target=self._drive, args=(flow,), daemon=True)
            self._running.add(thread)
            thread.start()

    def _drive(self, flow: Flow[Any]) -> None:
        result, failure = None, None
        try:
            result = _Drive(self._http, self.abandoned).run(flow)
        except BaseException as error:
            failure = error
        self._ended.put((threading.current_thread(), result, failure))
