"""The program ``fingersplit-client``: the commands of this distribution, where nothing else is installed."""

import pkgutil
import sys
from importlib import import_module
from importlib.metadata import version

from fingersplit_client import commands

__all__ = ["main"]


def main() -> None:
    """Run the program."""
    try:
        import typer
    except ImportError:
        sys.exit("The commands need typer: pip install 'fingersplit-client[cli]'.")
    app = typer.Typer(
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # with it, units in brackets would be taken for markup
        help="Grasp planning by a Fingersplit service.",
    )

    def print_version(wanted: bool) -> None:
        if wanted:
            typer.echo(f"fingersplit-client {version('fingersplit-client')}")
            raise typer.Exit

    @app.callback()
    def program(
        _version: bool = typer.Option(
            False, "--version", help="Print the version.", callback=print_version, is_eager=True
        ),
    ) -> None:
        """Grasp planning by a Fingersplit service."""

    for module in pkgutil.iter_modules(commands.__path__):
        command = getattr(import_module(f"{commands.__name__}.{module.name}"), module.name, None)
        if command is not None:
            app.command()(command)
    app()
