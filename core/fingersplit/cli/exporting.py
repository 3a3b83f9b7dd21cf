"""The command ``fingersplit export``."""

from pathlib import Path
from typing import Annotated

import typer

from fingersplit.cli.output import check_writable

__all__ = ["export"]


def export(
    result: Annotated[Path, typer.Argument(help="Result, as `plan --json` writes it.", exists=True, dir_okay=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write.")],
    export_format: Annotated[
        str,
        typer.Option(
            "--format",
            help="isaac_grasp, moveit, moveit_yaml, dexgraspbench, multi_gripper_grasp or dexgraspnet.",
        ),
    ],
    rank: Annotated[int | None, typer.Option(help="Only the grasp of this rank; else all feasible ones.")] = None,
) -> None:
    """Write the feasible grasps of a result in the format of another tool."""
    from fingersplit.formats import export as export_grasps
    from fingersplit.result import read_result

    check_writable(output)
    output.write_bytes(export_grasps(read_result(result), export_format, rank=rank))
    typer.echo(f"Wrote {export_format} to {output}.")
