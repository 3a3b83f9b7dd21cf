"""OFF: counts, then vertices and polygons, a line each."""

import re

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import ObjectFileError
from fingersplit.numerals import read_floats, read_integers
from fingersplit.objects.intake.polygons import Polygons
from fingersplit.objects.intake.refusals import (
    MAX_FACES_AS_TEXT,
    check_count,
    first_wrong,
    malformed,
    mismatch,
    not_a_number,
    truncated,
)

__all__ = ["parse_off"]

_HEADER = re.compile(rb"\s*(?:ST)?C?N?OFF\s+(\d{1,18})\s+(\d{1,18})(?:[ \t]+\d+)?[ \t]*\r?\n")

_BINARY = re.compile(rb"\s*(?:ST)?C?N?4?n?OFF\s+BINARY\b")


def parse_off(data: bytes) -> tuple[NDArray[np.float64], Polygons]:
    """Vertices (n, 3) and polygons; colours and normals behind them are left out."""
    text = re.sub(rb"#[^\r\n]*", b"", data)
    header = _HEADER.match(text)
    if header is None and _BINARY.match(text):
        raise ObjectFileError("binary_off", "The OFF file is binary; save it as text.")
    if header is None:
        raise ObjectFileError(
            "not_off", "The file does not start with 'OFF' and the numbers of vertices and faces on a line."
        )
    n_vertices, n_faces = int(header[1]), int(header[2])
    begin = text.count(b"\n", 0, header.end()) + 1
    rows = [(begin + k, line.split()) for k, line in enumerate(text[header.end() :].splitlines()) if line.strip()]
    announced = f"{n_vertices:,} vertices and {n_faces:,} faces, a line each"
    if len(rows) < n_vertices + n_faces:
        raise truncated(announced, f"{len(rows):,} lines")
    if len(rows) > n_vertices + n_faces:
        raise mismatch(f"The header counts {announced}, but {len(rows):,} lines follow.")
    check_count(n_vertices, MAX_FACES_AS_TEXT, "vertices")
    check_count(n_faces, MAX_FACES_AS_TEXT)
    vertices = np.array([_numbers(words, 3, line) for line, words in rows[:n_vertices]]).reshape(-1, 3)
    corners, sizes = list[int](), list[int]()
    for line, words in rows[n_vertices:]:
        polygon = _polygon(words, line)
        corners += polygon
        sizes.append(len(polygon))
    lines = np.array([line for line, _ in rows[n_vertices:]], np.int64)
    return vertices, Polygons(np.array(corners, np.int64), np.array(sizes, np.int64), lines)


def _numbers(words: list[bytes], count: int, line: int) -> list[float]:
    if len(words) < count:
        raise malformed(f"Line {line} has {len(words)} numbers instead of {count}.")
    try:
        return read_floats(words[:count])
    except ValueError:
        raise not_a_number(first_wrong(words[:count]) or b"", f"Line {line}") from None


def _polygon(words: list[bytes], line: int) -> list[int]:
    """Corners of a face: their number stands first."""
    for word in words[:1]:
        if not word.isdigit():
            raise malformed(f"Line {line} starts with {word.decode('latin1')[:30]!r}, not a face's number of corners.")
    count = int(words[0])
    if count > len(words) - 1:
        raise malformed(f"The face on line {line} says {count} corners, but its line holds {len(words) - 1}.")
    try:
        return read_integers(words[1 : count + 1])
    except ValueError:
        text = (first_wrong(words[1 : count + 1], read_integers) or b"").decode(errors="backslashreplace")[:30]
        raise malformed(f"The face on line {line} has {text!r} where whole numbers belong.") from None
