"""Progress of many plans on standard error: a bar where rich is installed, else a line that counts."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["progress_bar"]


@contextmanager
def progress_bar(total: int, shown: bool | None) -> Iterator[Callable[[str], None]]:
    """A bar of so many steps; call what it gives with the name of each that is done.

    Args:
        total: Number of steps.
        shown: Whether to show it; None for only if standard error is a terminal.
    """
    if not (sys.stderr.isatty() if shown is None else shown):
        yield lambda _name: None
        return
    try:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
    except ImportError:
        with _counting_line(total) as advance:
            yield advance
        return
    columns = (
        TextColumn("planning"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=total)
        yield lambda name: bar.update(task, advance=1, description=name)


@contextmanager
def _counting_line(total: int) -> Iterator[Callable[[str], None]]:
    done = 0

    def advance(name: str) -> None:
        nonlocal done
        done += 1
        print(f"\rplanning {done}/{total}  {name:<40.40}", end="", file=sys.stderr, flush=True)

    try:
        yield advance
    finally:
        print(file=sys.stderr)
