"""``cancel``: end jobs."""

import typer

from fingersplit_client.commands.connection import ApiKey, JobIds, Server, with_error_messages

__all__ = ["cancel"]


@with_error_messages
def cancel(job_ids: JobIds, server: Server = None, api_key: ApiKey = None) -> None:
    """End jobs that have not ended; those that have stay as they are."""
    from fingersplit_client.client import Client

    with Client(server, api_key=api_key) as client:
        for job_id in job_ids:
            typer.echo(f"{job_id}  {client.jobs.cancel(job_id).state}")
