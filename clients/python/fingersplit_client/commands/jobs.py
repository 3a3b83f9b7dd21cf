"""``jobs``: list jobs."""

from enum import StrEnum
from itertools import islice
from typing import Annotated, Any

import typer

from fingersplit_client.commands.connection import ApiKey, Server, with_error_messages
from fingersplit_client.commands.tables import number, print_table

__all__ = ["State", "jobs"]


class State(StrEnum):
    """Where a job stands; that of the wire types, without the time to load them."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


@with_error_messages
def jobs(
    state: Annotated[list[State] | None, typer.Option(help="Only jobs in this state; repeatable.")] = None,
    hand: Annotated[str | None, typer.Option(help="Only jobs for this hand.")] = None,
    name: Annotated[str | None, typer.Option(help="Only jobs whose object's name has this in it.")] = None,
    limit: Annotated[int, typer.Option(help="How many to list at most, newest first.", min=1)] = 20,
    server: Server = None,
    api_key: ApiKey = None,
) -> None:
    """List jobs, newest first."""
    from fingersplit_client.client import Client

    with Client(server, api_key=api_key) as client:
        states: Any = [one.value for one in state or ()]
        found = list(islice(client.jobs.all(state=states, hand=hand, object_name=name), limit))
    print_table(
        ("job", "state", "object", "hand", ">feasible", ">held", ">holding margin [N]", "accepted (UTC)"),
        (
            (
                job.id,
                job.state if job.state != "running" else f"{job.stage or 'running'} {job.progress:.0%}",
                job.object_name,
                job.hand,
                number(job.feasible, 0),
                number(job.verified, 0),
                number(job.holding_margin),
                f"{job.created_at:%Y-%m-%d %H:%M:%S}",
            )
            for job in found
        ),
    )
