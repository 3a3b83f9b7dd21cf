"""The commands about grasps from and for others: sources of parallel grasps, file formats, and exports."""

from pathlib import Path
from typing import Annotated

import typer

from fingersplit.cli.output import check_writable, new_table

__all__ = ["export", "formats", "sources"]


def export(
    result: Annotated[
        Path, typer.Argument(help="Result, as `plan --json` writes it, or the folder of a data set.", exists=True)
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write; for a data set, a new folder.")],
    export_format: Annotated[
        str, typer.Option("--format", help="One that is written, or a layout of data sets; see `fingersplit formats`.")
    ],
    rank: Annotated[
        int | None, typer.Option(help="Only the grasp of this rank; else all that can be executed.", min=1)
    ] = None,
    hand: Annotated[
        str | None, typer.Option(help="Name, folder or zip of the hand; default: the one of the result by its name.")
    ] = None,
) -> None:
    """Write the grasps of a result in the format of another tool, or those of a data set in another one's layout."""
    from fingersplit.formats import export_file, formats_that
    from fingersplit.formats.registry import known_format
    from fingersplit.hands.hand import load_hand
    from fingersplit.result import read_result

    if result.is_dir():
        _convert(result, output, export_format, {"--rank": rank, "--hand": hand})
        return
    check_writable(output)
    known_format(export_format, formats_that("write"))
    stored = read_result(result)
    file = export_file(stored, export_format, rank=rank, hand=load_hand(hand or stored.hand))
    output.write_bytes(file.content)
    typer.echo(f"Wrote {output}. {file.message}")


def _convert(folder: Path, output: Path, layout: str, of_results: dict[str, int | str | None]) -> None:
    from fingersplit.dataset import Dataset
    from fingersplit.dataset.converting import convert
    from fingersplit.errors import SettingsError

    for option, value in of_results.items():
        if value is not None:
            raise SettingsError(f"{option} is for results; leave it out for a data set.")
    typer.echo(f"Wrote {output}. {convert(Dataset(folder), layout, output)}")


def formats() -> None:
    """List the formats of other tools: what is read from them and written to them."""
    from rich.console import Console

    from fingersplit.dataset.layouts import available_layouts
    from fingersplit.formats import available_formats

    columns = ("format", "file", "parallel grasps", "hand grasps", "export", "what it is")
    table = new_table("File formats", dict.fromkeys(columns, "left"))
    for name, one in available_formats().items():
        uses = (one.read_parallel and "read", one.read_hand and "read", one.write and "written")
        table.add_row(name, one.suffix, *(use or "" for use in uses), one.title)
    console = Console()
    console.print(table)
    layouts = new_table(
        "Layouts of data sets, for `fingersplit export FOLDER`", {"layout": "left", "what it is": "left"}
    )
    for name, layout in available_layouts().items():
        layouts.add_row(name, layout.title)
    console.print(layouts)


def sources() -> None:
    """List the sources of parallel grasps, for `plan --source`."""
    from fingersplit.parallel_grasps.sources import available_sources

    for name, source in available_sources().items():
        typer.echo(f"{name}: {source.meaning}")
