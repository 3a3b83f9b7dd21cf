"""Who is next: owners that wait for an answer and the queue of jobs take turns, so that none starves the others."""

import asyncio
from collections import OrderedDict, deque
from typing import Generic, TypeVar

__all__ = ["JOBS", "Turns"]

Given = TypeVar("Given")

JOBS = ""
"""The client that stands for the queue of jobs, which shares its turns among owners itself."""


class Turns(Generic[Given]):
    """Clients in a circle, each with what it waits for in order.

    A client that comes anew, or after a pause, is served before those that were served since, so a single answer never
    waits behind the queue of jobs. A client that asks for much at once gets one turn a round.
    """

    def __init__(self) -> None:
        self._waiting: OrderedDict[str, deque[asyncio.Future[Given]]] = OrderedDict()
        self._last_was_answer = False

    @property
    def answers(self) -> int:
        """How many wait, the queue of jobs not counted."""
        return sum(not future.done() for client, queue in self._waiting.items() if client != JOBS for future in queue)

    def wait(self, client: str) -> "asyncio.Future[Given]":
        """Stand in the queue of a client; cancel what is returned to leave it."""
        future: asyncio.Future[Given] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(client, deque()).append(future)
        return future

    def next(self) -> "asyncio.Future[Given] | None":
        """Whose turn it is: of the owners the one that waits longest for a turn, after each of them the jobs.

        Returns:
            What that client waits with; None when nobody waits.
        """
        self._forget_cancelled()
        answers = next((client for client in self._waiting if client != JOBS), None)
        if answers is None or (self._last_was_answer and JOBS in self._waiting):
            client = JOBS if JOBS in self._waiting else answers
        else:
            client = answers
        if client is None:
            return None
        self._last_was_answer = client != JOBS
        queue = self._waiting[client]
        future = queue.popleft()
        if queue:
            self._waiting.move_to_end(client)
        else:
            del self._waiting[client]
        return future

    def _forget_cancelled(self) -> None:
        for client in list(self._waiting):
            queue = self._waiting[client]
            while queue and queue[0].done():
                queue.popleft()
            if not queue:
                del self._waiting[client]
