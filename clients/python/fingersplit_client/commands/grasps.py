"""``grasps``: the ranked grasps of a job, as a table, a document, another tool's file or a picture."""

from pathlib import Path
from typing import Annotated

import typer

from fingersplit_client.commands.connection import ApiKey, Server, with_error_messages
from fingersplit_client.commands.tables import number, print_table

__all__ = ["grasps"]


@with_error_messages
def grasps(
    job_id: Annotated[str, typer.Argument(help="Id of a job that has succeeded.", metavar="JOB")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the result document here.")] = None,
    picture: Annotated[Path | None, typer.Option(help="Write a PNG of the grasp here.")] = None,
    export: Annotated[Path | None, typer.Option(help="Write the grasps for another tool here.")] = None,
    export_format: Annotated[str, typer.Option("--format", help="Format of that file.")] = "moveit",
    rank: Annotated[int | None, typer.Option(help="Only this grasp, for picture and export.", min=1)] = None,
    server: Server = None,
    api_key: ApiKey = None,
) -> None:
    """Print the ranked grasps of a job, best first, and write what is asked for."""
    from fingersplit_client.client import Client
    from fingersplit_client.errors import JobFailed, invalid

    for path in (json_file, picture, export):
        if path is not None and not path.absolute().parent.is_dir():
            raise invalid(f"{path} cannot be written: the folder {path.parent} does not exist.")
    with Client(server, api_key=api_key) as client:
        job = client.jobs.get(job_id)
        if not job.ended:
            raise invalid(f"Job {job_id} is {job.state}; `watch {job_id}` waits for its end.")
        if job.result is None:
            raise JobFailed(job)
        print_table(
            ("rank", "feasible", ">P holds", ">margin [N]", "in simulation", ">Ferrari-Canny [N]", ">palm x y z [mm]"),
            (
                (
                    str(grasp.rank),
                    "yes" if grasp.feasible else "no",
                    number(None if grasp.p_hold is None else grasp.p_hold.value),
                    number(grasp.metrics.holding_margin),
                    {None: "", True: "held", False: "did not hold"}[grasp.held],
                    number(grasp.metrics.ferrari_canny, 3),
                    " ".join(f"{1e3 * x:.0f}" for x in grasp.palm.position),
                )
                for grasp in job.result.grasps
            ),
        )
        typer.echo(job.result.summary.message)
        if json_file is not None:
            job.result.save(json_file)
            typer.echo(f"Wrote the result to {json_file}.")
        if picture is not None:
            picture.write_bytes(job.result.picture(rank))
            typer.echo(f"Wrote the picture to {picture}.")
        if export is not None:
            export.write_bytes(client.jobs.export(job_id, export_format, rank=rank))
            typer.echo(f"Wrote {export_format} to {export}.")
