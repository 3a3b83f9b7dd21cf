"""The commands about grasps from and for others: sources of parallel grasps, file formats, and exports."""

from pathlib import Path
from typing import Annotated

import typer

from fingersplit.cli.output import check_writable, new_table

__all__ = ["export", "formats", "sources"]


def export(
    result: Annotated[Path, typer.Argument(help="Result, as `plan --json` writes it.", exists=True, dir_okay=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write.")],
    export_format: Annotated[str, typer.Option("--format", help="One that is written; see `fingersplit formats`.")],
    rank: Annotated[
        int | None, typer.Option(help="Only the grasp of this rank; else all that can be executed.", min=1)
    ] = None,
) -> None:
    """Write the grasps of a result in the format of another tool."""
    from fingersplit.formats import export_file
    from fingersplit.result import read_result

    check_writable(output)
    file = export_file(read_result(result), export_format, rank=rank)
    output.write_bytes(file.content)
    typer.echo(f"Wrote {output}. {file.message}")


def formats() -> None:
    """List the formats of other tools: what is read from them and written to them."""
    from rich.console import Console

    from fingersplit.formats import available_formats

    columns = ("format", "file", "parallel grasps", "hand grasps", "export", "what it is")
    table = new_table("File formats", dict.fromkeys(columns, "left"))
    for name, one in available_formats().items():
        uses = (one.read_parallel and "read", one.read_hand and "read", one.write and "written")
        table.add_row(name, one.suffix, *(use or "" for use in uses), one.title)
    Console().print(table)


def sources() -> None:
    """List the sources of parallel grasps, for `plan --source`."""
    from fingersplit.parallel_grasps.sources import available_sources

    for name, source in available_sources().items():
        typer.echo(f"{name}: {source.meaning}")
