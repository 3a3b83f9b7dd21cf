"""``outcome``: report what became of a grasp on a robot."""

from typing import Annotated

import typer

from fingersplit_client.commands.connection import ApiKey, Server, with_error_messages

__all__ = ["outcome"]


@with_error_messages
def outcome(
    job_id: Annotated[str, typer.Argument(help="Id of the job that planned the grasp.", metavar="JOB")],
    rank: Annotated[int, typer.Argument(help="Rank of the grasp.", min=1)],
    held: Annotated[
        bool, typer.Option("--held/--dropped", help="Whether the object stayed in the hand.", show_default=False)
    ],
    note: Annotated[str, typer.Option(help="What people should know of it.")] = "",
    server: Server = None,
    api_key: ApiKey = None,
) -> None:
    """Report what became of a grasp on a robot; of every attempt, also those that went well."""
    from fingersplit_client.client import Client

    with Client(server, api_key=api_key) as client:
        kept = client.outcomes.report(job_id, rank, held=held, note=note)
    predicted = "" if kept.p_hold is None else f"; predicted probability of holding {kept.p_hold:.2f}"
    typer.echo(f"{kept.id}  {'held' if kept.held else 'dropped'}{predicted}")
