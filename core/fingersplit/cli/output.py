"""What commands write and say: files, standard output, progress."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import Any

import typer
from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from fingersplit.errors import OutputError
from fingersplit.result.verification import Verification
from fingersplit.threads import Progress as Report

__all__ = ["JsonOutput", "check_writable", "new_table", "progress_bar", "verdict_cells"]


@dataclass(frozen=True)
class JsonOutput:
    """Where a document goes: a file, standard output (``-``), or nowhere (None).

    Raises:
        OutputError: The file cannot be written there.
    """

    path: Path | None

    def __post_init__(self) -> None:
        if not self.is_stdout:
            check_writable(self.path)

    @property
    def is_stdout(self) -> bool:
        """Whether the document takes standard output, so that everything for people goes to standard error."""
        return self.path is not None and str(self.path) == "-"

    @property
    def console(self) -> Console:
        """Where people are told something."""
        return Console(stderr=self.is_stdout)

    def write(self, document: dict[str, Any], title: str) -> None:
        """Write a document as JSON, and say so."""
        if self.path is None:
            return
        text = json.dumps(document, indent=2, allow_nan=False)
        if self.is_stdout:
            typer.echo(text)
        else:
            self.path.write_text(text + "\n")
            typer.echo(f"Wrote {title} to {self.path}.")


def check_writable(*paths: Path | None) -> None:
    """Refuse files that cannot be written, before any work is done; None is no file.

    Raises:
        OutputError: A folder is missing or read-only, or is itself given as the file.
    """
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise OutputError(f"{path} is a folder; give the file to write.")
        if not path.parent.is_dir():
            raise OutputError(f"{path} cannot be written: the folder {path.parent} does not exist.")
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise OutputError(f"{path} cannot be written: permission denied.")


def new_table(title: str, columns: dict[str, str], caption: str | None = None) -> Table:
    """A table whose columns are named and justified by ``columns``; only the last one wraps."""
    table = Table(title=title, caption=caption, box=box.SIMPLE_HEAD, collapse_padding=True, pad_edge=False)
    for number, (heading, justify) in enumerate(columns.items(), 1):
        table.add_column(heading, justify=justify, no_wrap=number < len(columns))  # type: ignore[arg-type]
    return table


def verdict_cells(report: Verification | None) -> tuple[str, str, str]:
    """Whether a grasp held, the slip [mm] and the turn [deg], for a table; empty where it was not verified."""
    if report is None:
        return "", "", ""
    held = "firmly" if report.held_firmly else "yes" if report.passed else "no"
    slip = "" if report.slip is None else f"{1e3 * report.slip:.1f}"
    return held, slip, "" if report.turn is None else f"{degrees(report.turn):.1f}"


@contextmanager
def progress_bar() -> Iterator[Report]:
    """A callback ``(stage, share)`` behind a progress bar on a terminal; silent in a pipe."""
    from fingersplit.cli.warming import kernels_are_compiled

    console = Console(stderr=True)
    if console.is_terminal and not kernels_are_compiled():
        console.print("Compiling the planner's kernels first (one to four minutes, once).")
    columns = (TextColumn("{task.description:>22}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage.replace("_", " "), completed=share)
