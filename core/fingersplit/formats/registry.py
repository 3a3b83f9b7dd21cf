"""The file formats: every module of this room may define some, and nothing else lists them."""

from collections.abc import Mapping
from functools import cache
from typing import Literal

from fingersplit.errors import FormatError, suggestion
from fingersplit.formats.file_format import FileFormat
from fingersplit.registry import find_by_name

__all__ = ["available_formats", "formats_that", "known_format"]


@cache
def available_formats() -> dict[str, FileFormat]:
    """Every format by name."""
    return find_by_name("fingersplit.formats", FileFormat)


def formats_that(use: Literal["read_parallel", "read_hand", "write"]) -> dict[str, FileFormat]:
    """The formats that can be used for something, by name."""
    return {name: one for name, one in available_formats().items() if getattr(one, use) is not None}


def known_format(name: str, among: Mapping[str, FileFormat]) -> FileFormat:
    """A format by its name.

    Raises:
        FormatError: It is not one of these; the message lists them.
    """
    if name not in among:
        raise FormatError(f"Unknown format {name!r}; {suggestion(name, among)}")
    return among[name]
