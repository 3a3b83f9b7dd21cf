"""``submit``: upload meshes and queue a job for each."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from fingersplit_client.commands.connection import ApiKey, Server, with_error_messages

__all__ = ["submit"]


@with_error_messages
def submit(
    files: Annotated[
        list[Path], typer.Argument(help="Meshes or point clouds.", metavar="FILE...", exists=True, dir_okay=False)
    ],
    hand: Annotated[str, typer.Option(help="Hand to plan for.")] = "barrett",
    starts: Annotated[int, typer.Option(help="Most runs of the finger splitting.", min=1)] = 64,
    seed: Annotated[int, typer.Option(help="Seed of every random choice.", min=0)] = 0,
    unit: Annotated[str, typer.Option(help="Unit of the files: m, mm, cm or in.")] = "m",
    mass: Annotated[float | None, typer.Option(help="Mass of the object [kg].")] = None,
    friction: Annotated[float | None, typer.Option(help="Coulomb friction between the object and the pads.")] = None,
    verified: Annotated[int, typer.Option(help="Simulate ranked grasps until so many have held.", min=0)] = 0,
    option: Annotated[
        list[str] | None,
        typer.Option(help="Anything else that an object or a job can be given, as NAME=VALUE; repeatable."),
    ] = None,
    server: Server = None,
    api_key: ApiKey = None,
) -> None:
    """Upload meshes that the service does not know, queue a job for each and print the jobs' ids."""
    from fingersplit_client.client import Client
    from fingersplit_client.options import ObjectKeywords, job_request

    given = {"hand": hand, "starts": starts, "seed": seed, "unit": unit, "verified": verified}
    options: dict[str, Any] = given | {"mass": mass, "friction": friction} | _named(option or [])
    asked = job_request("", options)  # what is not valid is refused before anything is sent
    said = {name: value for name, value in options.items() if name in ObjectKeywords.__annotations__}
    with Client(server, api_key=api_key) as client:
        for file in files:
            uploaded = client.objects.upload(file, **said)
            job = client.jobs.create(asked.model_copy(update={"object_id": uploaded.id}))
            typer.echo(f"{job.id}  {file.name}" if len(files) > 1 else job.id)


def _named(texts: list[str]) -> dict[str, Any]:
    """Values by name; each is JSON where it can be read as that, else a text."""
    from fingersplit_client.errors import invalid

    found: dict[str, Any] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not sign:
            raise invalid(f"--option {text!r} must be NAME=VALUE.")
        try:
            found[name.strip().replace("-", "_")] = json.loads(value)
        except ValueError:
            found[name.strip().replace("-", "_")] = value
    return found
