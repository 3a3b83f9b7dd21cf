"""Subcommands about hands: propose a description, and say whether one is right."""

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["app"]

app = typer.Typer(help="Describe your own hand, and check the description.", no_args_is_help=True)


@app.command()
def draft(
    model: Annotated[Path, typer.Argument(help="MJCF or URDF file.", exists=True, dir_okay=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to make: the model's files and hand.toml.")],
    palm: Annotated[str | None, typer.Option(help="Body of the palm, if not the one that is found.")] = None,
    fingers: Annotated[
        str | None, typer.Option(help="Last bodies of the fingers, separated by commas, if not those that are found.")
    ] = None,
    root: Annotated[
        Path | None, typer.Option(help="Folder of all its files.", show_default="the model's own", file_okay=False)
    ] = None,
) -> None:
    """Propose the description of a hand by moving its model; look at it with `fingersplit hand check`."""
    from fingersplit.hands.draft import draft_folder

    wanted = tuple(name.strip() for name in fingers.split(",")) if fingers else ()
    notes = draft_folder(model, root or model.parent, output, palm, wanted)
    typer.echo(f"{output / 'hand.toml'} is a proposal. Check it with: fingersplit hand check {output}")
    for note in notes:
        typer.echo(f"- {note}")


@app.command()
def schema() -> None:
    """Print the JSON Schema of descriptions, `hand.toml`, with units."""
    import json

    from fingersplit.hands.description import description_schema

    typer.echo(json.dumps(description_schema(), indent=2))


@app.command()
def check(
    hand: Annotated[str, typer.Argument(help="Folder or zip of a hand, or the name of one that ships.")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the report here as JSON, too.")] = None,
    page: Annotated[Path | None, typer.Option(help="Write a page of pictures and tables here, HTML.")] = None,
    trial: Annotated[bool, typer.Option(help="Plan for sphere, box and cylinder in three sizes.")] = True,
) -> None:
    """Say what a hand's description makes of it, and what to change where a number is bad."""
    import json

    from fingersplit.hands.check import check_hand, report_lines
    from fingersplit.hands.check.page import report_page
    from fingersplit.hands.hand import load_hand

    loaded = load_hand(hand)
    report = check_hand(loaded)
    if trial:
        from fingersplit.planning.hand_trial import try_hand

        report["trial"] = try_hand(loaded)
    for line in report_lines(report):
        typer.echo(line)
    if json_file is not None:
        json_file.write_text(json.dumps(report, indent=2))
    if page is not None:
        page.write_text(report_page(loaded, report))
