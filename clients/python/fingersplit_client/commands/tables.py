"""Tables for people: headings with units, numbers to the right."""

from collections.abc import Iterable, Sequence

__all__ = ["number", "print_table"]


def print_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print rows below headings; a heading that begins with ``>`` stands over numbers."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in headings:
        table.add_column(Text(heading.lstrip(">")), justify="right" if heading[0] == ">" else "left", no_wrap=True)
    for row in rows:
        table.add_row(*map(Text, row))  # texts, in which brackets are no markup
    console = Console()
    console.print(table) if console.is_terminal else Console(width=200).print(table)


def number(value: float | None, digits: int = 2) -> str:
    """A number, or nothing where there is none."""
    return "" if value is None else f"{value:.{digits}f}"
