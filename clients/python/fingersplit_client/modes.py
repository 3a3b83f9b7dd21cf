"""How flows are driven: with blocking calls or with awaited ones, and methods that are written once for both."""

import inspect
from collections.abc import AsyncGenerator, Callable, Coroutine, Generator
from typing import Any, Concatenate, Generic, ParamSpec, get_args, get_origin, overload

from typing_extensions import TypeVar

from fingersplit_client._awaited import Awaited
from fingersplit_client._blocking import Blocking
from fingersplit_client._exchange import Policy, exchange
from fingersplit_client._flow import Emit, Flow, Stream

__all__ = ["Awaited", "Blocking", "Bound", "Mode", "operation", "stream"]

Mode = TypeVar("Mode", bound=Blocking | Awaited, default=Blocking)
Params = ParamSpec("Params")
Result = TypeVar("Result")


class Bound(Generic[Mode]):
    """What has operations: a client, a resource, a result; `Mode` says whether they block or are awaited."""

    def _mode(self) -> Mode:
        raise NotImplementedError

    @property
    def _policy(self) -> Policy:
        return self._mode().policy

    def _exchange(self, method: str, path: str, **arguments: Any) -> Flow[Any]:
        return exchange(self._policy, method, path, **arguments)


class operation(Generic[Params, Result]):  # noqa: N801 -- a decorator
    """Makes a flow a method: of a blocking owner it returns the result, of an awaited one a coroutine of it."""

    def __init__(self, flow: Callable[Concatenate[Any, Params], Flow[Result]]) -> None:
        self.flow = flow
        self.__doc__ = flow.__doc__
        self._signature = _signature(flow)

    @overload
    def __get__(self, instance: None, owner: type | None = None) -> "operation[Params, Result]": ...
    @overload
    def __get__(self, instance: Bound[Blocking], owner: type | None = None) -> Callable[Params, Result]: ...
    @overload
    def __get__(
        self, instance: Bound[Awaited], owner: type | None = None
    ) -> Callable[Params, Coroutine[Any, Any, Result]]: ...
    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        if instance is None:
            return self

        def call(*args: Params.args, **kwargs: Params.kwargs) -> Any:
            return instance._mode().run(self.flow(instance, *args, **kwargs))

        return _named(call, self.flow, self._signature)


class stream(Generic[Params, Result]):  # noqa: N801 -- a decorator
    """Makes a flow that emits items a method, which returns an iterator or, of an awaited owner, an async iterator."""

    def __init__(self, flow: Callable[Concatenate[Any, Params], Stream[Result]]) -> None:
        self.flow = flow
        self.__doc__ = flow.__doc__
        self._signature = _signature(flow)

    @overload
    def __get__(self, instance: None, owner: type | None = None) -> "stream[Params, Result]": ...
    @overload
    def __get__(
        self, instance: Bound[Blocking], owner: type | None = None
    ) -> Callable[Params, Generator[Result, None, None]]: ...
    @overload
    def __get__(
        self, instance: Bound[Awaited], owner: type | None = None
    ) -> Callable[Params, AsyncGenerator[Result, None]]: ...
    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        if instance is None:
            return self

        def call(*args: Params.args, **kwargs: Params.kwargs) -> Any:
            return instance._mode().stream(self.flow(instance, *args, **kwargs))

        return _named(call, self.flow, self._signature)


def _signature(flow: Callable[..., Any]) -> inspect.Signature:
    """Signature of a method for people: without ``self``, and returning what the flow returns or emits."""
    signature = inspect.signature(flow)
    returned = signature.return_annotation
    if not isinstance(returned, str):
        yielded, _, result = get_args(returned)
        emitted = next((one for one in get_args(yielded) if get_origin(one) is Emit), None)
        returned = get_args(emitted)[0] if emitted else result
    return signature.replace(parameters=list(signature.parameters.values())[1:], return_annotation=returned)


def _named(call: Callable[..., Any], flow: Callable[..., Any], signature: inspect.Signature) -> Callable[..., Any]:
    call.__name__, call.__qualname__, call.__doc__ = flow.__name__, flow.__qualname__, flow.__doc__
    call.__module__, call.__signature__ = flow.__module__, signature  # type: ignore[attr-defined]
    return call
