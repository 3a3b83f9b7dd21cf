"""The client without I/O: an operation is a flow that yields what is to be done and is given back what came of it.

`Blocking` and `Awaited` (`fingersplit_client.modes`) drive the same flows, one with blocking calls, one with awaited
ones. A flow that is interrupted (Ctrl-C, a cancelled task) has the exception thrown in at its ``yield`` and may still
yield what has to be cleaned up.
"""

from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

__all__ = [
    "Abandon",
    "Begin",
    "Command",
    "Emit",
    "Flow",
    "Interruption",
    "NextEnded",
    "NextLine",
    "Open",
    "Pause",
    "Send",
    "Stream",
    "Work",
]

Result = TypeVar("Result")


class Interruption(BaseException):
    """Thrown into a flow that nobody is interested in any more, so that it cleans up."""


@dataclass(frozen=True)
class Send:
    """A request to send; the flow goes on with its response, or with the transport's error.

    Attributes:
        method: The HTTP method.
        path: Path of the address.
        arguments: What `httpx2.Client.build_request` takes: ``json``, ``params``, ``files``, ``headers``.
        timeout: How long to wait for the next part of the answer [s].
    """

    method: str
    path: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    timeout: float = 60.0


@dataclass(frozen=True)
class Open(Send):
    """Like `Send` for an answer that is read line by line; the flow goes on with its response, head only if it is one.

    The answer of a refusal is read to its end at once.
    """


@dataclass(frozen=True)
class NextLine:
    """The next line of the opened answer; None at its end."""


@dataclass(frozen=True)
class Pause:
    """A pause of some seconds."""

    seconds: float


@dataclass(frozen=True)
class Work:
    """Something local that takes its time, such as reading a file; the flow goes on with what it returns."""

    function: Callable[[], Any]


@dataclass(frozen=True)
class Begin(Generic[Result]):
    """Flows to run side by side, so many at a time; `NextEnded` gives what they return."""

    flows: "Iterable[Flow[Result]]"
    at_once: int


@dataclass(frozen=True)
class NextEnded:
    """What the next of the begun flows to end has returned; None when all have."""


@dataclass(frozen=True)
class Abandon:
    """The end of interest in the flows that were begun: those on their way are interrupted, no other is begun."""


@dataclass(frozen=True)
class Emit(Generic[Result]):
    """An item of a stream, for whoever iterates over it."""

    item: Result


Command = Send | NextLine | Pause | Work | Begin[Any] | NextEnded | Abandon

Flow = Generator[Command, Any, Result]
"""What an operation does: it yields commands, takes what came of them and returns its result."""

Stream = Generator[Command | Emit[Result], Any, None]
"""What an operation with many results does: it emits them between its commands."""
