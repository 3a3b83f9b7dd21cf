"""``watch``: follow jobs until they have ended."""

from typing import Annotated

import typer

from fingersplit_client.commands.connection import ApiKey, JobIds, Server, with_error_messages

__all__ = ["watch"]


@with_error_messages
def watch(
    job_ids: JobIds,
    timeout: Annotated[float, typer.Option(help="How long to watch each job at most [s].", min=0)] = 3600.0,
    server: Server = None,
    api_key: ApiKey = None,
) -> None:
    """Follow jobs until they have ended; the exit code is 1 when one ended without a feasible grasp.

    Ctrl-C ends watching, not the jobs.
    """
    from fingersplit_client.client import Client
    from fingersplit_client.errors import JobFailed
    from fingersplit_client.schemas import JobSummary

    def print_progress(job: JobSummary) -> None:
        typer.echo(f"{job.id}  {job.state if job.stage is None else f'{job.stage} {job.progress:.0%}'}", err=True)

    good = True
    with Client(server, api_key=api_key) as client:
        for job_id in job_ids:
            try:
                job = client.jobs.wait(job_id, timeout, on_progress=print_progress)
            except JobFailed as error:
                typer.echo(str(error))
                good = False
            else:
                typer.echo(f"{job.id}  {job.result.summary.message if job.result else job.state}")
                good = good and bool(job.feasible)
    if not good:
        raise typer.Exit(1)
