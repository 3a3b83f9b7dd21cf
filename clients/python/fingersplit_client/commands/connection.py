"""What all commands share: where the service is, and how errors are shown."""

import functools
import sys
from collections.abc import Callable
from typing import Annotated, ParamSpec, TypeVar

import typer

__all__ = ["ApiKey", "JobIds", "Server", "with_error_messages"]

BAD_INPUT = 2

Params = ParamSpec("Params")
Result = TypeVar("Result")

Server = Annotated[
    str | None,
    typer.Option(help="Address of the service.", envvar="FINGERSPLIT_SERVER", show_default="http://127.0.0.1:8000"),
]
ApiKey = Annotated[
    str | None, typer.Option(help="Key of the service, where it wants one.", envvar="FINGERSPLIT_API_KEY")
]
JobIds = Annotated[list[str], typer.Argument(help="Ids of jobs.", metavar="JOB...")]


def with_error_messages(command: Callable[Params, Result]) -> Callable[Params, Result]:
    """Make a command tell errors of client and service in a sentence, with exit code 2."""

    @functools.wraps(command)
    def run(*args: Params.args, **kwargs: Params.kwargs) -> Result:
        # Imported here, because `fingersplit` loads every command before it knows which is meant.
        from fingersplit_client.errors import FingersplitClientError

        try:
            return command(*args, **kwargs)
        except (FingersplitClientError, OSError) as error:
            advice = getattr(error, "advice", "")
            sys.stderr.write(f"Error: {error}{'' if not advice or advice in str(error) else f' {advice}'}\n")
            raise typer.Exit(BAD_INPUT) from None

    return run
