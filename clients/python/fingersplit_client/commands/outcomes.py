"""``outcomes``: what became of grasps on robots, beside what was predicted."""

from itertools import islice
from pathlib import Path
from typing import Annotated, Literal

import typer

from fingersplit_client.commands.connection import ApiKey, Server, with_error_messages
from fingersplit_client.commands.tables import number, print_table

__all__ = ["outcomes"]


@with_error_messages
def outcomes(
    job_id: Annotated[str | None, typer.Option("--job", help="Only outcomes of this job.")] = None,
    hand: Annotated[str | None, typer.Option(help="Only outcomes with this hand.")] = None,
    limit: Annotated[int, typer.Option(help="How many to list at most, newest first.", min=1)] = 20,
    export: Annotated[
        Path | None, typer.Option(help="Write all of them here, as a table (.csv) or a document a line.")
    ] = None,
    server: Server = None,
    api_key: ApiKey = None,
) -> None:
    """List what became of grasps on robots, and how that compares with what was predicted."""
    from fingersplit_client.client import Client
    from fingersplit_client.errors import invalid

    if export is not None and not export.absolute().parent.is_dir():
        raise invalid(f"{export} cannot be written: the folder {export.parent} does not exist.")
    with Client(server, api_key=api_key) as client:
        found = list(islice(client.outcomes.all(job_id=job_id, hand=hand), limit))
        summary = client.outcomes.summary(job_id=job_id, hand=hand)
        if export is not None:
            kind: Literal["csv", "jsonl"] = "csv" if export.suffix == ".csv" else "jsonl"
            export.write_bytes(client.outcomes.export(kind, job_id=job_id, hand=hand))
    print_table(
        ("job", ">rank", "object", "hand", "outcome", ">predicted", "reported (UTC)", "note"),
        (
            (
                one.job_id,
                str(one.rank),
                one.object_name,
                one.hand,
                "held" if one.held else "dropped",
                number(one.p_hold),
                f"{one.created_at:%Y-%m-%d %H:%M:%S}",
                one.note,
            )
            for one in found
        ),
    )
    typer.echo(f"{summary.held} of {summary.outcomes} held.")
    if summary.brier_score is not None:
        typer.echo(
            f"{summary.predicted} with a predicted probability: Brier score {summary.brier_score:.3f}, "
            f"calibration error {summary.calibration_error:.3f}."
        )
    if export is not None:
        typer.echo(f"Wrote {export}.")
