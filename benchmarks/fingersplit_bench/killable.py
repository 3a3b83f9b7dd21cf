"""A function in a process of its own that is killed when it takes too long, and replaced when it dies."""

import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Self

__all__ = ["Crashed", "KillableWorker", "Slow"]


class Slow(Exception):  # noqa: N818 - an outcome, not an error
    """The call took longer than it might."""


class Crashed(Exception):  # noqa: N818 - an outcome, not an error
    """The process died, or the call raised what is not expected; the text says which."""


class KillableWorker:
    """Calls one function in another process, one call at a time; a context manager."""

    def __init__(self, function: Callable[..., Any], seconds: float) -> None:
        """Name the function, which must be importable, and how long a call may take [s]."""
        self._function, self._seconds = function, seconds
        self._context = multiprocessing.get_context("spawn")
        self._process: Any = None
        self._pipe: Connection | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    def call(self, *arguments: object) -> Any:
        """The function's value.

        Raises:
            Slow: It took too long and was killed.
            Crashed: It raised, or its process died.
        """
        if self._pipe is None:
            self._pipe, other = self._context.Pipe()
            self._process = self._context.Process(target=_serve, args=(self._function, other), daemon=True)
            self._process.start()
            other.close()
        self._pipe.send(arguments)
        try:
            if not self._pipe.poll(self._seconds):
                self._stop()
                raise Slow(f"over {self._seconds:g} s")
            good, value = self._pipe.recv()
        except EOFError:
            self._process.join()
            code = self._process.exitcode
            self._stop()
            raise Crashed(f"the process ended with {code}") from None
        if not good:
            raise Crashed(value)
        return value

    def _stop(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self._pipe is not None:
            self._pipe.close()
        self._process = self._pipe = None


def _serve(function: Callable[..., Any], pipe: Connection) -> None:
    while True:
        try:
            arguments = pipe.recv()
        except EOFError:
            return
        try:
            answer = True, function(*arguments)
        except Exception as error:  # what it may be is what the caller wants to know
            answer = False, f"{type(error).__name__}: {error}"
        pipe.send(answer)
