"""The ``fingersplit`` program; other distributions add commands through the entry point ``fingersplit.commands``."""

import sys
from functools import cache
from importlib.metadata import entry_points, version
from typing import Annotated

import typer

from fingersplit.cli.dataset import dataset
from fingersplit.cli.depth import from_depth
from fingersplit.cli.exporting import export, formats, sources
from fingersplit.cli.grid import grid
from fingersplit.cli.hand import app as hand_app
from fingersplit.cli.hands import hands, warm
from fingersplit.cli.planning import plan
from fingersplit.cli.recording import record, review, setup_viewer
from fingersplit.cli.settings import scene, settings
from fingersplit.cli.verifying import verify_stored
from fingersplit.errors import FingersplitError

__all__ = ["add_commands", "main"]

BAD_INPUT = 2
"""Exit code for input that cannot be used; 1 means that no feasible grasp was found, or that none held."""


app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # with it, units in brackets would be taken for markup
    help="Grasp planning for multi-fingered hands by finger splitting.",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fingersplit {version('fingersplit')}")
        raise typer.Exit


@app.callback()
def _program(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Grasp planning for multi-fingered hands by finger splitting."""


app.command()(plan)
app.command("verify")(verify_stored)
app.command()(from_depth)
app.command()(grid)
app.command()(export)
app.command()(dataset)
app.command()(formats)
app.command()(sources)
app.command()(record)
app.command()(review)
app.command()(setup_viewer)
app.command()(settings)
app.command()(scene)
app.command()(hands)
app.add_typer(hand_app, name="hand")
app.command()(warm)


@cache
def add_commands() -> None:
    """Add the commands of the other installed distributions, once: client, service and benchmarks."""
    for entry in entry_points(group="fingersplit.commands"):
        command = entry.load()
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=entry.name)
        else:
            app.command(entry.name)(command)


def main() -> None:
    """Run the program; bad input ends with one sentence on standard error and exit code 2."""
    add_commands()
    try:
        app()
    except FingersplitError as error:
        typer.echo(f"Error: {error}", err=True)
        sys.exit(BAD_INPUT)
