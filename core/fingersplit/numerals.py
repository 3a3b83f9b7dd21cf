"""Numbers out of text, as file formats write them.

Python's own conversions also take underscores between digits, so that 4_0.0 is 40, and of text that is no bytes the
digits of all scripts.
"""

from collections.abc import Sequence

__all__ = ["read_floats", "read_integers"]


def read_floats(words: Sequence[bytes]) -> list[float]:
    """Decimal numbers, ``nan`` and ``inf`` among them.

    Raises:
        ValueError: A word is no number.
    """
    _check(words)
    return list(map(float, words))


def read_integers(words: Sequence[bytes]) -> list[int]:
    """Whole numbers.

    Raises:
        ValueError: A word is no whole number, or has thousands of digits.
    """
    _check(words)
    return list(map(int, words))


def _check(words: Sequence[bytes]) -> None:
    if b"_" in b"".join(words):
        raise ValueError("A number has an underscore.")
