"""Refusals that all formats share, and the limits on what a file may hold."""

from collections.abc import Callable, Sequence

from fingersplit.errors import ObjectFileError
from fingersplit.numerals import read_floats

__all__ = [
    "BLANKS",
    "MAX_FACES",
    "MAX_FACES_AS_TEXT",
    "check_count",
    "first_wrong",
    "malformed",
    "mismatch",
    "not_a_number",
    "truncated",
]

MAX_FACES = 2_000_000
"""Most triangles a file may hold; a finer mesh adds memory and time, not grasps."""
MAX_FACES_AS_TEXT = 1_000_000
"""Most of them as text, whose words take time and memory: some seconds and 500 MB for as many."""

BLANKS = b"\0 \t\r\n"
"""Bytes that may follow the end of a binary file and mean nothing."""


def malformed(what: str) -> ObjectFileError:
    """The error for a file that breaks its format's rules."""
    return ObjectFileError("malformed", f"{what} Export the file again.")


def mismatch(what: str) -> ObjectFileError:
    """The error for a file that goes on behind all that it announces."""
    return ObjectFileError("count_mismatch", f"{what} The two must agree. Export the file again.")


def truncated(announced: str, present: str) -> ObjectFileError:
    """The error for a file that ends before all that it announces."""
    return ObjectFileError(
        "truncated",
        f"The header announces {announced}, but the file has {present}: it is cut off or its header is wrong. "
        "Copy or export it again.",
    )


def not_a_number(word: bytes, where: str, *, whole: bool = False) -> ObjectFileError:
    """The error for a word of a text file that should be a number, or a whole one."""
    text = repr(word.decode(errors="backslashreplace")[:30])
    if b";" in word or word.count(b",") > 1:
        return ObjectFileError(
            "malformed", f"{where} has {text}; numbers are separated by blanks, and decimals written with a point."
        )
    if b"," in word:
        return ObjectFileError(
            "malformed", f"{where} has {text}, a number with a comma; decimals are written with a point, such as 0.5."
        )
    return ObjectFileError("malformed", f"{where} has {text}, which is not a {'whole ' * whole}number.")


def first_wrong(words: Sequence[bytes], read: Callable[[list[bytes]], object] = read_floats) -> bytes | None:
    """The first of the words that ``read`` refuses when it is given that word alone; None if there is none."""
    for word in words:
        try:
            read([word])
        except ValueError:
            return word
    return None


def check_count(count: int, most: int, what: str = "faces") -> None:
    """Refuse more faces, or other things, than there may be, before any memory is spent on them."""
    if count > most:
        raise ObjectFileError(
            "too_many_faces",
            f"The file has {count:,} {what}, more than the limit of {most:,}; simplify or thin it first.",
        )
