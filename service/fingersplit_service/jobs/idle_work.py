"""Calls for workers that nobody waits for with a connection open: work in advance, and work behind answers."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fingersplit_service.jobs.slot import WorkerSlot
from fingersplit_service.jobs.worker import run_niced

__all__ = ["IdleCall", "IdleWork"]

_log = logging.getLogger(__name__)
_NICENESS = 19  # it takes what nothing else wants
_MAX_IN_ADVANCE = 200  # that wait; older ones are forgotten


@dataclass(frozen=True)
class IdleCall:
    """A call of a function in a worker; ``answer`` is whom it is for, None where it may as well not be made."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    deadline_s: float
    answer: "asyncio.Future[Any] | None" = None

    async def run(self, worker: WorkerSlot) -> None:
        """Make the call at the lowest priority, and give its result or error to whom it is for."""
        try:
            result = await worker.run(run_niced, _NICENESS, self.function, *self.arguments, deadline_s=self.deadline_s)
        except BaseException as error:
            self._fail(error)
            if isinstance(error, asyncio.CancelledError):
                raise
        else:
            if self.answer is not None and not self.answer.done():
                self.answer.set_result(result)

    def _fail(self, error: BaseException) -> None:
        if self.answer is None:
            _log.warning("%s was given up: %r", self.function.__name__, error)
        elif not self.answer.done():
            if isinstance(error, asyncio.CancelledError):
                self.answer.cancel()
            else:
                self.answer.set_exception(error)


class IdleWork:
    """Calls that wait: those in advance, newest first, which may be forgotten, and those behind answers, in order."""

    def __init__(self) -> None:
        self._in_advance = deque[IdleCall](maxlen=_MAX_IN_ADVANCE)
        self._behind = deque[IdleCall]()

    @property
    def has_work_behind(self) -> bool:
        """Whether a call behind an answer waits."""
        return bool(self._behind)

    def add(self, call: IdleCall) -> None:
        """Queue a call, in advance if nobody is to get its answer."""
        (self._in_advance if call.answer is None else self._behind).append(call)

    def forget(self) -> None:
        """Drop what was to be done in advance."""
        self._in_advance.clear()

    def next(self, *, in_advance: bool, behind: bool) -> IdleCall | None:
        """The call to make now, of those that may be made; None without one."""
        while self._behind and self._behind[0].answer and self._behind[0].answer.done():
            self._behind.popleft()  # who wanted it has gone
        if self._behind and behind:
            return self._behind.popleft()
        return self._in_advance.pop() if self._in_advance and in_advance else None
