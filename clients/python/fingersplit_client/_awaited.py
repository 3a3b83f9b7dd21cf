"""Drives flows with awaited calls, in asyncio."""

import asyncio
import contextlib
from collections.abc import AsyncGenerator, AsyncIterator, Generator
from typing import Any, TypeVar

import anyio
import anyio.to_thread
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

__all__ = ["Awaited"]

Result = TypeVar("Result")

_CLEANUP = 10.0
"""Most that a cancelled flow may still take to clean up [s]."""


class Awaited:
    """A client's connections, used with awaited calls.

    Args:
        http: The connections.
        policy: How requests are sent.
    """

    def __init__(self, http: httpx2.AsyncClient, policy: Policy) -> None:
        self._http, self.policy = http, policy

    async def run(self, flow: Flow[Result]) -> Result:
        """Drive a flow to its end; when its task is cancelled, to the end of its cleaning up."""
        return await _Drive(self._http).run(flow)

    async def stream(self, flow: Stream[Result]) -> AsyncGenerator[Result, None]:
        """Drive a flow and yield what it emits."""
        drive = _Drive(self._http)
        interruption: BaseException | None = None
        try:
            command = next(flow)
            while interruption is None:
                try:
                    if isinstance(command, Emit):
                        yield command.item
                        answer = None
                    else:
                        answer = await drive.execute(command)
                except Exception as error:
                    command = flow.throw(error)
                except BaseException as error:
                    interruption = error
                else:
                    command = flow.send(answer)
        except StopIteration:
            pass
        finally:
            if interruption is not None:
                await drive.clean_up(flow, interruption)
            with anyio.CancelScope(shield=True):
                await drive.close()
        if interruption is not None:
            raise interruption


class _Drive:
    """One flow on its way: its opened answer, and the tasks of the flows it has begun."""

    def __init__(self, http: httpx2.AsyncClient) -> None:
        self._http = http
        self._response: httpx2.Response | None = None
        self._lines: AsyncIterator[str] | None = None
        self._tasks: _Tasks | None = None

    async def run(self, flow: Flow[Result]) -> Result:
        try:
            command = next(flow)
            while True:
                try:
                    answer = await self.execute(command)
                except Exception as error:
                    command = flow.throw(error)
                except BaseException as error:
                    await self.clean_up(flow, error)
                    raise
                else:
                    command = flow.send(answer)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        finally:
            with anyio.CancelScope(shield=True):
                await self.close()

    async def clean_up(self, flow: Generator[Any, Any, Any], interruption: BaseException) -> None:
        """Let an interrupted flow do what it still has to, whoever cancels meanwhile."""
        with anyio.move_on_after(_CLEANUP, shield=True), contextlib.suppress(BaseException):  # the interruption counts
            left = isinstance(interruption, GeneratorExit)  # which would close what a flow delegates to
            command = flow.throw(Interruption() if left else interruption)
            while True:
                try:
                    answer = await self.execute(command)
                except BaseException as error:
                    command = flow.throw(error)
                else:
                    command = flow.send(answer)

    async def execute(self, command: Command) -> Any:
        match command:
            case Open():
                return await self._open(command)
            case Send():
                timeout = httpx2.Timeout(command.timeout, pool=None)
                return await self._http.request(command.method, command.path, timeout=timeout, **command.arguments)
            case NextLine():
                return await anext(self._lines, None) if self._lines else None
            case Pause():
                await anyio.sleep(command.seconds)
            case Work():
                return await anyio.to_thread.run_sync(command.function)
            case Begin():
                self._tasks = _Tasks(self._http, command)
            case NextEnded():
                return await self._tasks.next_ended() if self._tasks else None
            case Abandon():
                if self._tasks:
                    await self._tasks.close()
            case _:
                raise TypeError(f"{command} cannot be done here")
        return None

    async def close(self) -> None:
        await self._close_response()
        if self._tasks:
            await self._tasks.close()

    async def _open(self, command: Open) -> httpx2.Response:
        await self._close_response()
        timeout = httpx2.Timeout(command.timeout, pool=None)
        request = self._http.build_request(command.method, command.path, timeout=timeout, **command.arguments)
        response = await self._http.send(request, stream=True)
        if response.is_success:
            self._response, self._lines = response, response.aiter_lines()
        else:
            await response.aread()
        return response

    async def _close_response(self) -> None:
        if self._response is not None:
            await self._response.aclose()
        self._response, self._lines = None, None


class _Tasks:
    """Flows side by side, each in a task of asyncio; a new one is begun when one has ended."""

    def __init__(self, http: httpx2.AsyncClient, begin: Begin[Any]) -> None:
        self._http = http
        self._flows = iter(begin.flows)
        self._running: set[asyncio.Task[Any]] = set()
        for _ in range(begin.at_once):
            self._begin_next()

    async def next_ended(self) -> Any:
        if not self._running:
            return None
        ended, _ = await asyncio.wait(self._running, return_when=asyncio.FIRST_COMPLETED)
        task = ended.pop()
        self._running.discard(task)
        self._begin_next()
        return task.result()

    async def close(self) -> None:
        for task in self._running:
            task.cancel()
        await asyncio.gather(*self._running, return_exceptions=True)
        self._running.clear()

    def _begin_next(self) -> None:
        flow = next(self._flows, None)
        if flow is not None:
            self._running.add(asyncio.create_task(_Drive(self._http).run(flow)))
